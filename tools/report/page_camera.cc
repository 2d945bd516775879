#include "tools/report/page_camera.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "tools/mantle/bad_input.h"
#include "tools/report/child_process.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kPatience = 60s;  // with a browser that begins, or draws without a graphics card
constexpr std::size_t kMostAnswer_bytes = 256 << 20;
constexpr int kCommands = 3, kAnswers = 4;

std::string FromBase64(const std::string& text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                      : c == '/'             ? 63
                                             : -1;
    if (value < 0) continue;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8));
  }
  return bytes;
}

// "file:///a%20b": every byte that is no plain one, in hexadecimal.
std::string FileUrl(const fs::path& file) {
  std::string url = "file://";
  for (const char c : fs::absolute(file).string()) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) != 0 || std::strchr("/-_.~", c) != nullptr;
    url += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return url;
}

/// One end of a pipe.
struct Descriptor {
  int fd{-1};
  ~Descriptor() { Close(); }
  void Close() {
    if (fd >= 0) close(fd);
    fd = -1;
  }
};

}  // namespace

class PageCamera::Browser {
 public:
  Browser(const fs::path& program, int width, int height, const fs::path& scratch) {
    Descriptor child_in, child_out;
    Pipe(&child_in, &to_);
    Pipe(&from_, &child_out);
    std::vector<std::string> arguments{"--headless",
                                       "--remote-debugging-pipe",
                                       "--user-data-dir=" + (scratch / "chromium").string(),
                                       "--disable-gpu",
                                       "--enable-unsafe-swiftshader",
                                       "--hide-scrollbars",
                                       "--no-first-run",
                                       "--no-default-browser-check",
                                       "--disable-background-networking",
                                       "--disable-component-update",
                                       "--disable-sync",
                                       "--disable-extensions",
                                       fmt::format("--window-size={},{}", width, height)};
    // Chromium refuses to sandbox itself as root. The page is one that was made here.
    if (geteuid() == 0) arguments.push_back("--no-sandbox");
    arguments.push_back("about:blank");
    child_.emplace(program, arguments, std::vector<int>{child_in.fd, child_out.fd},
                   std::vector<int>{kCommands, kAnswers}, scratch / "chromium.log");
    child_in.Close();
    child_out.Close();
    const Json target = Call("Target.createTarget", {{"url", "about:blank"}});
    const Json session =
        Call("Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}});
    session_ = session.at("sessionId");
    Call("Emulation.setDeviceMetricsOverride",
         {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
  }

  Json Call(const char* method, const Json& params) {
    const int id = ++id_;
    Json command = {{"id", id}, {"method", method}, {"params", params}};
    if (!session_.empty()) command["sessionId"] = session_;
    Send(command.dump() + '\0');
    for (;;) {
      Json answer = Json::parse(Receive(), nullptr, false);
      if (!answer.is_object() || answer.value("id", 0) != id) continue;
      if (answer.contains("error")) {
        throw CannotGoOn(fmt::format("chromium: {}: {}", method, answer["error"].dump()));
      }
      return answer.at("result");
    }
  }

  /// The value of an expression on the page.
  Json Evaluate(const std::string& expression) {
    const Json result =
        Call("Runtime.evaluate",
             {{"expression", expression}, {"awaitPromise", true}, {"returnByValue", true}});
    if (result.contains("exceptionDetails")) {
      throw CannotGoOn("chromium: the page fails: " + result["exceptionDetails"].dump());
    }
    return result.at("result").value("value", Json());
  }

  double duration_s{0};

 private:
  static void Pipe(Descriptor* read_end, Descriptor* write_end) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
      throw CannotGoOn(fmt::format("no pipe: {}", std::strerror(errno)));
    }
    read_end->fd = ends[0];
    write_end->fd = ends[1];
  }

  void Send(const std::string& text) const {
    for (std::size_t at = 0; at < text.size();) {
      const auto n = write(to_.fd, text.data() + at, text.size() - at);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw CannotGoOn("chromium: has ended");
      at += static_cast<std::size_t>(n);
    }
  }

  // The next message.
  std::string Receive() {
    const auto end = Clock::now() + kPatience;
    std::size_t searched = 0;
    for (;;) {
      const std::size_t zero = buffer_.find('\0', searched);
      if (zero != buffer_.npos) {
        std::string message = buffer_.substr(0, zero);
        buffer_.erase(0, zero + 1);
        return message;
      }
      searched = buffer_.size();
      if (Clock::now() > end || buffer_.size() > kMostAnswer_bytes) {
        throw CannotGoOn(fmt::format("chromium: no answer within {} s", kPatience / 1s));
      }
      pollfd waits{from_.fd, POLLIN, 0};
      if (poll(&waits, 1, 200) <= 0) continue;
      char chunk[1 << 16];
      const auto n = read(from_.fd, chunk, sizeof chunk);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw CannotGoOn("chromium: has ended");
      buffer_.append(chunk, static_cast<std::size_t>(n));
    }
  }

  Descriptor to_, from_;
  std::string buffer_, session_;
  int id_{0};
  std::optional<ChildProcess> child_;  ///< ended first
};

fs::path FindChromium() { return FindProgram({"chromium", "chromium-browser", "google-chrome"}); }

PageCamera::PageCamera(const fs::path& page, int width, int height, const fs::path& scratch) {
  const fs::path program = FindChromium();
  if (program.empty()) {
    throw BadInput("chromium is not in PATH: must be installed (Debian: apt install chromium)");
  }
  browser_ = std::make_unique<Browser>(program, width, height, scratch);
  browser_->Call("Page.enable", Json::object());
  browser_->Call("Page.navigate", {{"url", FileUrl(page)}});
  const auto end = Clock::now() + kPatience;
  while (browser_->Evaluate("typeof window.mantleFilm") != "object") {
    if (Clock::now() > end) throw CannotGoOn("chromium: the page is not drawn");
    std::this_thread::sleep_for(100ms);
  }
  const Json duration = browser_->Evaluate("window.mantleFilm.begin()");
  if (!duration.is_number()) throw CannotGoOn("chromium: has no WebGL, must have for a film");
  browser_->duration_s = duration.get<double>();
}

PageCamera::~PageCamera() = default;

double PageCamera::duration_s() const { return browser_->duration_s; }

std::string PageCamera::Picture(double time_s) {
  browser_->Evaluate(fmt::format("window.mantleFilm.show({})", time_s));
  const Json picture =
      browser_->Call("Page.captureScreenshot", {{"format", "jpeg"}, {"quality", 92}});
  return FromBase64(picture.at("data").get<std::string>());
}

}  // namespace mantle::tools
