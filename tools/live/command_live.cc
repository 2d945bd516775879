#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <optional>
#include <thread>

#include "mantle/version.h"
#include "tools/live/live_feed.h"
#include "tools/live/live_server.h"
#include "tools/live/recorder.h"
#include "tools/live/request_check.h"
#include "tools/live/run_process.h"
#include "tools/mantle/commands.h"
#include "tools/mantle/interrupt.h"
#include "tools/mantle/lcm_bridge.h"
#include "tools/mantle/standard_output.h"
#include "tools/report/page_data.h"
#include "tools/report/page_file.h"

/// `mantle live`: a run as it goes, in a browser.

namespace mantle::tools {
namespace {

using namespace std::chrono_literals;

constexpr const char* kHelp =
    "Watch a run in a browser as it goes (docs/live.md): the page of `mantle report`, fed from LCM "
    "by a small\nserver on this machine. The loop never waits for a viewer.\n\n"
    "  mantle live scenes/steer.toml                  # runs it in real time, as mantle run "
    "--realtime --lcm\n"
    "  mantle live --lcm 'udpm://239.255.76.67:7667?ttl=0'    # watches a run that is going on\n\n"
    "Open the address that it prints; several viewers may. Buttons: stop (as Ctrl-C stops a run: "
    "drives\nstopped, results kept) and record. Ctrl-C ends the server, and a run that it has "
    "begun.\nExit status 0: ended. 2: bad input. 3: the run that it began could not go on or was "
    "stopped; what it\nreached is in DIR.partial.";

constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0";
constexpr auto kPeriod = 40ms;  // 25 pictures a second
constexpr int kQueued = 64;     // messages of a channel that wait
constexpr int kReceive_ms = 100;

struct LiveOptions {
  std::string scene, controller, bus, out, url{kUrl}, record_to{"results"};
  std::vector<std::string> overrides;
  LiveServerOptions server{.port = 8137};
  bool control{false}, until_end{false};
};

/// Hands messages on; ends Receive by throwing, so that a flood does not hold it.
class Forward final : public TelemetrySink {
 public:
  struct Ended {};

  Forward(LiveFeed* feed, Recorder* recorder, const std::atomic<bool>& ending)
      : feed_(feed), recorder_(recorder), ending_(ending) {}
  void Write(const StateTelemetry& m) override { Pass(m); }
  void Write(const ReducedStateTelemetry& m) override { Pass(m); }
  void Write(const PlanTelemetry& m) override { Pass(m); }
  void Write(const DrivesTelemetry& m) override { Pass(m); }
  void Write(const EnergyTelemetry& m) override { Pass(m); }
  void Write(const StatusTelemetry& m) override { Pass(m); }
  void Write(const ShapeTelemetry& m) override { Pass(m); }
  void Write(const ControlTelemetry& m) override { Pass(m); }
  void Write(const WaterTelemetry& m) override { Pass(m); }
  void Write(const SessionTelemetry& m) override { Pass(m); }
  void Write(const SensorsTelemetry& m) override { recorder_->Write(m); }
  void Write(const CommandTelemetry& m) override { recorder_->Write(m); }
  void Write(const CycleTelemetry& m) override { recorder_->Write(m); }

 private:
  template <typename Message>
  void Pass(const Message& m) {
    if (ending_) throw Ended{};
    feed_->Write(m);
    recorder_->Write(m);
  }

  LiveFeed* feed_;
  Recorder* recorder_;
  const std::atomic<bool>& ending_;
};

class Live {
 public:
  explicit Live(const LiveOptions& options)
      : options_(options), page_(MakePage(options)), recorder_(options.record_to) {}

  ~Live() { End(); }
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  int Execute() {
    if (options_.scene.empty() && options_.until_end) {
      throw BadInput("--until-end: is for a run that is begun here, must be with SCENE");
    }
    link_ = OpenLcm({.url = options_.url, .receive = true, .queued_messages = kQueued});
    LiveServerOptions server = options_.server;
    server.buttons = IsLoopback(server.address) || options_.control;
    buttons_ = server.buttons;
    server_ = StartLiveServer(server, Source());
    CatchInterrupts();
    if (!options_.scene.empty()) run_.emplace(RunArguments());
    const bool six = server.address.find(':') != std::string::npos;
    Print("live at http://{}{}{}:{}/ from {}\n", six ? "[" : "", server.address, six ? "]" : "",
          server_->port(), options_.url);
    FlushOutput();
    receiver_ = std::thread([this] { ReceiveAll(); });
    Serve();
    End();
    recorder_.Finish();
    if (failure_) std::rethrow_exception(failure_);
    if (!run_) return 0;
    run_->Stop();
    return run_->Wait();
  }

 private:
  // Every thread.
  void End() {
    ending_ = true;
    feed_.Close();
    if (receiver_.joinable()) receiver_.join();
    server_.reset();
  }

  static std::string MakePage(const LiveOptions& options) {
    Json data = {{"format", kPageFormat},
                 {"made_by", fmt::format("Mantle {}", kVersion)},
                 {"runs", Json::array()},
                 {"live", {{"url", options.url}}}};
    return FillPage(ConnectedPage(ReportPage()), data);
  }

  std::vector<std::string> RunArguments() const {
    std::vector<std::string> words{"run", "--realtime", "--lcm", options_.url};
    for (const std::string& override : options_.overrides) {
      words.insert(words.end(), {"--set", override});
    }
    const auto add = [&](const char* option, const std::string& value) {
      if (!value.empty()) words.insert(words.end(), {option, value});
    };
    add("--controller", options_.controller);
    add("--bus", options_.bus);
    add("--out", options_.out);
    words.insert(words.end(), {"--", options_.scene});
    return words;
  }

  LiveSource Source() {
    return {.page = [this] { return page_; },
            .next = [this](std::uint64_t* seen, int wait_ms) { return feed_.Next(seen, wait_ms); },
            .press = [this](std::string_view name) { return Press(name); },
            .viewers = [this](int viewers) { viewers_ = viewers; }};
  }

  void ReceiveAll() {
    Forward forward(&feed_, &recorder_, ending_);
    try {
      while (!ending_) {
        link_->Receive(kReceive_ms, forward);
        malformed_ = link_->counters().malformed;
      }
    } catch (const Forward::Ended&) {
    } catch (...) {
      failure_ = std::current_exception();
      failed_ = true;
    }
  }

  void Serve() {
    while (!Interrupted() && !failed_) {
      if (run_ && !run_status_) {
        run_status_ = run_->Poll();
        if (run_status_ && (*run_status_ == kExitBadInput || options_.until_end)) return;
        if (run_status_) Complain("the run has ended with status {}; Ctrl-C ends", *run_status_);
      }
      if (stop_asked_.exchange(false) && run_) run_->Stop();
      feed_.Publish(ServerJson());
      std::this_thread::sleep_for(kPeriod);
    }
  }

  // Why the run cannot be stopped; empty: it can.
  std::string WhyNotStop(const LiveFeed::Figures& figures) const {
    if (!buttons_) return "buttons are off: others than this machine may look (--control)";
    if (run_) return run_status_ ? "the run has ended" : "";
    return figures.session ? CannotStop(*figures.session) : "no run says that it is there";
  }

  Json ServerJson() const {
    const LiveFeed::Figures f = feed_.figures();
    const Recorder::Figures r = recorder_.figures();
    const std::string why = WhyNotStop(f);
    Json j = {{"viewers", viewers_.load()},
              {"url", options_.url},
              {"messages", f.messages > 0},
              {"refused", f.refused + malformed_},
              {"quiet_s", f.age_s ? Json(static_cast<int>(*f.age_s)) : Json()},
              {"two_runs", f.two_runs},
              {"stop", {{"possible", why.empty()}, {"why", why}}},
              {"recording",
               {{"on", r.on}, {"possible", buttons_}, {"folder", r.folder}, {"note", r.note}}}};
    j["run"] = run_ ? Json{{"ended", run_status_.has_value()},
                           {"status", run_status_ ? Json(*run_status_) : Json()}}
                    : Json();
    return j;
  }

  // From the server's threads.
  std::string Press(std::string_view name) {
    std::string fault;
    if (name == "stop") {
      const LiveFeed::Figures figures = feed_.figures();
      if (!options_.scene.empty()) {
        stop_asked_ = true;
      } else {
        fault = figures.session ? StopSession(*figures.session) : "no run says that it is there";
      }
    } else if (name == "record") {
      recorder_.Toggle();
      const Recorder::Figures r = recorder_.figures();
      if (!r.on) fault = r.note;
    } else {
      return {};
    }
    return Json{{"done", fault.empty()}, {"why", fault}}.dump(-1, ' ', false,
                                                              Json::error_handler_t::replace);
  }

  const LiveOptions& options_;
  const std::string page_;
  LiveFeed feed_;
  Recorder recorder_;
  std::unique_ptr<LcmLink> link_;
  bool buttons_{false};
  std::atomic<bool> ending_{false}, failed_{false}, stop_asked_{false};
  std::atomic<int> viewers_{0};
  std::atomic<std::uint64_t> malformed_{0};
  std::thread receiver_;
  std::exception_ptr failure_;
  std::optional<int> run_status_;
  std::unique_ptr<LiveServer> server_;
  std::optional<RunProcess> run_;  ///< stopped first
};

}  // namespace

void AddLiveCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("live", kHelp);
  static LiveOptions options;  // lives as long as the parser that points to it
  command->add_option("SCENE", options.scene,
                      "Scene with a table [control] to run in real time; without one a run that is "
                      "going on is watched");
  command->add_option("--lcm", options.url, "Where the run speaks")
      ->type_name("URL")
      ->capture_default_str();
  const char* run = "With SCENE";
  CLI::Option* scene = command->get_option("SCENE");
  command->add_option("--set", options.overrides, "Override a key of the scene; repeatable")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->needs(scene)
      ->group(run);
  command->add_option("--controller", options.controller, "Instead of the scene's")
      ->needs(scene)
      ->group(run);
  command->add_option("--bus", options.bus, "Instead of the scene's")
      ->type_name("SPEC")
      ->needs(scene)
      ->group(run);
  command->add_option("--out", options.out, "Folder for the results (default: results/SCENE)")
      ->type_name("DIR")
      ->needs(scene)
      ->group(run);
  command->add_flag("--until-end", options.until_end, "End with the run")->group(run);
  const char* server = "Server";
  command->add_option("--port", options.server.port, "Port; 0: one that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str()
      ->group(server);
  command
      ->add_option("--listen", options.server.address,
                   "Address to listen on; others than this machine's loopback let others look")
      ->type_name("ADDRESS")
      ->capture_default_str()
      ->group(server);
  command->add_flag("--control", options.control, "Let those others press the buttons too")
      ->group(server);
  command->add_option("--viewers", options.server.most_viewers, "At most so many at a time")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->group(server);
  command->add_option("--record-to", options.record_to, "Where recordings get their folders")
      ->type_name("DIR")
      ->capture_default_str()
      ->group(server);
  command->callback([&exit_status] { exit_status = Live(options).Execute(); });
}

}  // namespace mantle::tools
