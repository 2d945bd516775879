#include <algorithm>
#include <cstdio>

#include "tools/mantle/commands.h"
#include "tools/mantle/standard_output.h"
#include "tools/report/page_file.h"

/// `mantle report`: results as one page to look at.

namespace mantle::tools {
namespace {

constexpr const char* kHelp =
    "Make one HTML file of folders of results, to look at (docs/report.md): a replay in 3-D, plots "
    "that\nmove with it, tables. It opens in a browser from the disk, without a server or a "
    "network.\n\n"
    "  mantle report results/steer                       # results/steer/report.html\n"
    "  mantle report results/mpc results/pid --out both.html     # laid over one another\n"
    "  mantle report results/steer.partial               # what a stopped run reached\n"
    "  mantle report results/compare                     # the full and the reduced model\n\n"
    "Reads what `mantle run`, `static`, `modes`, `compare` and `study` leave. The file is made "
    "whole or\nnot at all. Exit status 0: made. 2: bad input, nothing changed.";

struct ReportOptions {
  std::vector<std::string> folders;
  std::string out;
  double megabytes{4.2};
  bool json{false};
};

int Report(const ReportOptions& options) {
  std::vector<std::filesystem::path> folders(options.folders.begin(), options.folders.end());
  std::filesystem::path out = options.out;
  if (out.empty()) out = folders.size() == 1 ? folders.front() / kReportName : kReportName;
  PageOptions page;
  page.run_bytes = static_cast<std::size_t>(1e6 * options.megabytes);
  const ReportFile report = WriteReport(folders, out, page);
  if (options.json) {
    PrintText(Dump({{"report", report.file.string()},
                    {"bytes", report.bytes},
                    {"runs", report.labels},
                    {"notes", report.notes}}));
    return 0;
  }
  Print("{}: {} run{}, {:.1f} MB; open it in a browser\n", report.file.string(),
        report.labels.size(), report.labels.size() == 1 ? "" : "s",
        static_cast<double>(report.bytes) / 1e6);
  for (const std::string& note : report.notes) Print("  {}\n", note);
  return 0;
}

}  // namespace

void AddReportCommand(CLI::App& app, int& exit_status) {
  CLI::App* command = app.add_subcommand("report", kHelp);
  static ReportOptions options;  // lives as long as the parser that points to it
  command->add_option("DIR", options.folders, "Folders of results")->required();
  command
      ->add_option("--out", options.out,
                   "File to write (default: DIR/report.html; of several, report.html here)")
      ->type_name("FILE");
  command
      ->add_option("--size", options.megabytes,
                   "Largest size of what one run puts on the page; its shapes are thinned to it")
      ->type_name("MB")
      ->check(CLI::Range(0.1, 500.0))
      ->capture_default_str();
  command->add_flag("--json", options.json, "One JSON object on standard output");
  command->callback([&exit_status] { exit_status = Report(options); });
}

}  // namespace mantle::tools
