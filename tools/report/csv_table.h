#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// A table of a results folder (docs/outputs.md): titles, then rows of numbers; a cell that is no
/// number (a word, or nothing) is NaN.

namespace mantle::tools {

struct CsvTable {
  std::vector<std::string> titles;
  std::vector<std::vector<double>> columns;  ///< one for each title, all of one length
  bool cut_short{false};                     ///< the last row was not whole, and is left out

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().size(); }
  /// Null where there is none of this name.
  const std::vector<double>* Find(std::string_view title) const;
};

/// `source` names the text in what is thrown: BadInput where a row has another number of cells than
/// the titles, or there are no titles.
CsvTable ParseCsv(std::string_view text, const std::string& source);

/// Throws BadInput also where the file is no regular one, or cannot be read.
CsvTable ReadCsvTable(const std::filesystem::path& file);

}  // namespace mantle::tools
