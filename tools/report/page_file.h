#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/report/page_data.h"

/// The report: the page that is built from tools/report/page/, with the data put in.

namespace mantle::tools {

inline constexpr const char* kReportName = "report.html";

/// The page as it was built, with a mark where the data goes. Throws BadInput where Mantle was
/// built without it, and says why and what to do.
std::string ReportPage();

/// `page` with the data at its mark. What is not UTF-8 in the data is shown as U+FFFD. Throws
/// std::runtime_error where the page has not one mark.
std::string FillPage(std::string page, const Json& data);

/// `page` allowed to connect to the server that it came from: its policy allows none. Throws
/// std::runtime_error where it has not one place that says so.
std::string ConnectedPage(std::string page);

struct ReportFile {
  std::filesystem::path file;
  std::size_t bytes{0};
  std::vector<std::string> labels;  ///< of the runs on it
  std::vector<std::string> notes;   ///< what its reader is told first, by run
};

/// Reads folders of results and writes `out` from them, whole or not at all. Throws BadInput as
/// ReadRunFolder and ReportPage, and where the folder of `out` does not exist or take it;
/// CannotGoOn where the disk takes no more.
ReportFile WriteReport(const std::vector<std::filesystem::path>& folders,
                       const std::filesystem::path& out, const PageOptions& options = {});

/// For --report, before anything is written: throws as ReportPage.
void DemandReportPage(bool report);

/// For --report: where `report` says so, the report of a folder of results into that folder, and,
/// unless `quiet`, a line that says where it is. Throws as WriteReport.
void ReportBeside(bool report, const std::filesystem::path& folder, bool quiet);

}  // namespace mantle::tools
