#include "tools/report/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>

#include "loop/scene/regular_file.h"
#include "tools/mantle/bad_input.h"

namespace mantle::tools {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{4} << 30;

double ToNumber(std::string_view cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool whole = error == std::errc() && end == cell.data() + cell.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

// Calls cell(text) for each cell of a line; a quoted one may hold commas.
template <typename Cell>
std::size_t Split(std::string_view line, Cell cell) {
  std::size_t count = 0;
  while (true) {
    std::size_t end;
    if (line.starts_with('"')) {
      const std::size_t quote = line.find('"', 1);
      end = line.find(',', quote == line.npos ? 0 : quote);
    } else {
      end = line.find(',');
    }
    cell(count++, line.substr(0, end));
    if (end == line.npos) return count;
    line.remove_prefix(end + 1);
  }
}

}  // namespace

const std::vector<double>* CsvTable::Find(std::string_view title) const {
  const auto found = std::find(titles.begin(), titles.end(), title);
  return found == titles.end() ? nullptr
                               : &columns[static_cast<std::size_t>(found - titles.begin())];
}

CsvTable ParseCsv(std::string_view text, const std::string& source) {
  CsvTable table;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    ++number;
    if (end == text.npos) {  // every row ends with a line feed
      table.cut_short = true;
      break;
    }
    text.remove_prefix(end + 1);
    if (number == 1) {
      Split(line, [&](std::size_t, std::string_view cell) { table.titles.emplace_back(cell); });
      table.columns.resize(table.titles.size());
      continue;
    }
    const std::size_t cells = Split(line, [&](std::size_t i, std::string_view cell) {
      if (i < table.columns.size()) table.columns[i].push_back(ToNumber(cell));
    });
    if (cells != table.titles.size()) {
      throw BadInput(fmt::format("{}: line {} has {} cells, must be {} as the titles", source,
                                 number, cells, table.titles.size()));
    }
  }
  if (table.titles.empty() || table.titles.front().empty()) {
    throw BadInput(fmt::format("{}: has no line of titles", source));
  }
  return table;
}

CsvTable ReadCsvTable(const std::filesystem::path& file) {
  try {
    return ParseCsv(scene::ReadRegularFile(file, kMostBytes), file.string());
  } catch (const scene::UnreadableFile& error) {
    throw BadInput(fmt::format("{}: cannot be read: {}", file.string(), error.what()));
  }
}

}  // namespace mantle::tools
