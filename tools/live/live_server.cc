#include "tools/live/live_server.h"

#include <fmt/format.h>
#include <httplib.h>
#include <unistd.h>

#include <atomic>
#include <thread>
#include <utility>

#include "tools/live/request_check.h"
#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

constexpr int kWait_ms = 500;      // for something new, before a viewer is looked after again
constexpr time_t kPatience_s = 5;  // with a peer that neither sends nor takes
constexpr time_t kKeepAlive_s = 2;
constexpr std::size_t kMostBody_bytes = 1024;
constexpr int kSpareThreads = 4;  // for pages and buttons while every viewer's is taken

std::string HostName() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 ? name : "";
}

class Server final : public LiveServer {
 public:
  Server(const LiveServerOptions& options, LiveSource source)
      : options_(options), source_(std::move(source)), host_name_(HostName()) {
    const auto threads = static_cast<std::size_t>(options.most_viewers + kSpareThreads);
    http_.new_task_queue = [threads] { return new httplib::ThreadPool(threads); };
    http_.set_read_timeout(kPatience_s);
    http_.set_write_timeout(kPatience_s);
    http_.set_keep_alive_timeout(kKeepAlive_s);
    http_.set_payload_max_length(kMostBody_bytes);
    http_.set_tcp_nodelay(true);
    // Two servers on one port would share its viewers by chance.
    http_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    http_.set_default_headers({{"X-Content-Type-Options", "nosniff"},
                               {"X-Frame-Options", "DENY"},
                               {"Cross-Origin-Resource-Policy", "same-origin"},
                               {"Referrer-Policy", "no-referrer"},
                               {"Cache-Control", "no-store"}});
    Route();
    port_ = options.port == 0 ? http_.bind_to_any_port(options.address)
            : http_.bind_to_port(options.address, options.port) ? options.port
                                                                : -1;
    if (port_ <= 0) {
      throw BadInput(fmt::format(
          "--port: {} on {}: cannot be listened on: must be free, and the address this machine's",
          options.port, options.address));
    }
    thread_ = std::thread([this] { http_.listen_after_bind(); });
    while (!http_.is_running()) std::this_thread::yield();
  }

  ~Server() override {
    ending_ = true;
    http_.stop();
    thread_.join();
  }

  int port() const override { return port_; }

 private:
  // Answers the request itself where it is refused.
  bool Refused(const httplib::Request& request, RequestKind kind, httplib::Response* response) {
    const auto header = [&](const char* name) { return request.get_header_value(name); };
    std::string why = RequestFault(
        {header("Host"), header("Origin"), header("Sec-Fetch-Site"), header("X-Mantle")}, kind,
        host_name_);
    if (why.empty() && kind == RequestKind::kButton && !options_.buttons) {
      why = "buttons are off where others than this machine may look (--control)";
    }
    if (why.empty()) return false;
    response->status = 403;
    response->set_content(why + "\n", "text/plain; charset=utf-8");
    return true;
  }

  void Route() {
    http_.Get("/", [this](const httplib::Request& request, httplib::Response& response) {
      if (Refused(request, RequestKind::kPage, &response)) return;
      response.set_content(source_.page(), "text/html; charset=utf-8");
    });
    http_.Get("/events", [this](const httplib::Request& request, httplib::Response& response) {
      if (Refused(request, RequestKind::kFeed, &response)) return;
      Feed(&response);
    });
    http_.Post("/press/([a-z]{1,16})",
               [this](const httplib::Request& request, httplib::Response& response) {
                 if (Refused(request, RequestKind::kButton, &response)) return;
                 const std::string answer = source_.press(request.matches[1].str());
                 if (answer.empty()) {
                   response.status = 404;
                 } else {
                   response.set_content(answer, "application/json");
                 }
               });
  }

  void Feed(httplib::Response* response) {
    if (++viewers_ > options_.most_viewers) {
      --viewers_;
      response->status = 503;
      response->set_header("Retry-After", "5");
      response->set_content(fmt::format("{} viewers are the most\n", options_.most_viewers),
                            "text/plain; charset=utf-8");
      return;
    }
    source_.viewers(viewers_);
    response->set_chunked_content_provider(
        "text/event-stream",
        [this, seen = std::uint64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
          if (ending_) {
            sink.done();
            return true;
          }
          const auto text = source_.next(&seen, kWait_ms);
          if (text == nullptr || text->empty()) return sink.is_writable();
          return sink.write(text->data(), text->size());
        },
        [this](bool) { source_.viewers(--viewers_); });
  }

  const LiveServerOptions options_;
  const LiveSource source_;
  const std::string host_name_;
  std::atomic<bool> ending_{false};
  std::atomic<int> viewers_{0};
  int port_{-1};
  httplib::Server http_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<LiveServer> StartLiveServer(const LiveServerOptions& options, LiveSource source) {
  return std::make_unique<Server>(options, std::move(source));
}

}  // namespace mantle::tools
