#include "tools/report/page_file.h"

#include <fmt/format.h>

#include <stdexcept>

#include "loop/scene/regular_file.h"
#include "tools/mantle/bad_input.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/standard_output.h"

namespace mantle::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = "/*MANTLE-REPORT-DATA*/";
constexpr std::uintmax_t kMostPage_bytes = 64 << 20;
constexpr const char* kMissingName = "report.missing";  // why there is no page, in a line

// As built, or as installed: the first of the two that has the page, else the last.
fs::path PageFolder() {
  const fs::path beside = fs::read_symlink("/proc/self/exe").parent_path();
  const fs::path built = beside / "report";
  if (fs::exists(built / kReportName) || fs::exists(built / kMissingName)) return built;
  return beside.parent_path() / "share" / "mantle";
}

}  // namespace

std::string ReportPage() {
  const fs::path folder = PageFolder();
  try {
    return scene::ReadRegularFile(folder / kReportName, kMostPage_bytes);
  } catch (const scene::UnreadableFile&) {
    std::string why = "it must be installed beside the program";
    try {
      why = scene::ReadRegularFile(folder / kMissingName, 4096);
      while (!why.empty() && why.back() == '\n') why.pop_back();
    } catch (const scene::UnreadableFile&) {
    }
    throw BadInput(
        fmt::format("the report's page is missing ({}): {}", (folder / kReportName).string(), why));
  }
}

std::string FillPage(std::string page, const Json& data) {
  const std::size_t mark = page.find(kMark);
  if (mark == page.npos || page.find(kMark, mark + 1) != page.npos) {
    throw std::runtime_error("the report's page has not one place for its data");
  }
  const std::string json = data.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";  // no text of a run ends the script that holds it
    } else {
      text += c;
    }
  }
  page.replace(mark, kMark.size(), text);
  return page;
}

std::string ConnectedPage(std::string page) {
  constexpr std::string_view kNone = "connect-src 'none'", kSelf = "connect-src 'self'";
  const std::size_t place = page.find(kNone);
  if (place == page.npos || place > page.find("<style>")) {
    throw std::runtime_error("the report's page has no policy for its connections");
  }
  return page.replace(place, kNone.size(), kSelf);
}

ReportFile WriteReport(const std::vector<fs::path>& folders, const fs::path& out,
                       const PageOptions& options) {
  const std::string page = ReportPage();
  std::vector<RunRecord> records;
  for (const fs::path& folder : folders) {
    for (RunRecord& record : ReadRunFolder(folder)) records.push_back(std::move(record));
  }
  TellApart(&records);
  const fs::path folder = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (!out.has_filename() || fs::is_directory(out)) {
    throw BadInput(fmt::format("--out: {}: must name a file", out.string()));
  }
  if (!fs::is_directory(folder)) {
    throw BadInput(fmt::format("--out: {}: there is no such folder", folder.string()));
  }
  ReportFile report{out, 0, {}, {}};
  const std::string text = FillPage(page, PageData(records, options));
  report.bytes = text.size();
  for (const RunRecord& record : records) {
    report.labels.push_back(record.label);
    for (const std::string& note : record.notes) {
      report.notes.push_back(fmt::format("{}: {}", record.label, note));
    }
  }
  WriteWhole(folder, out.filename().string(), text);
  return report;
}

void DemandReportPage(bool report) {
  if (report) ReportPage();
}

void ReportBeside(bool report, const fs::path& folder, bool quiet) {
  if (!report) return;
  const ReportFile made = WriteReport({folder}, folder / kReportName);
  if (!quiet) Print("  report in {}\n", made.file.string());
}

}  // namespace mantle::tools
