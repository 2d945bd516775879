#include "tests/tools/scene_mutants.h"

#include <fmt/format.h>

#include <regex>
#include <sstream>
#include <utility>

namespace mantle::testing_tools {
namespace {

constexpr const char* kNumber = R"(([-+]?\b\d+(?:\.\d+)?(?:e[-+]?\d+)?\b))";
constexpr const char* kText = R"(("[^"\n]*"))";
constexpr const char* kValue = R"(= *([^\n#]+))";
constexpr const char* kKey = R"((?:^|\n|\{ |, )([a-z_]+) *=)";

const std::vector<std::string> kNumbers = {"0",
                                           "-0.0",
                                           "-1",
                                           "1",
                                           "2",
                                           "3",
                                           "7",
                                           "1e308",
                                           "-1e308",
                                           "1e-308",
                                           "5e-324",
                                           "nan",
                                           "-nan",
                                           "inf",
                                           "-inf",
                                           "1e400",
                                           "9223372036854775807",
                                           "-9223372036854775808",
                                           "9223372036854775808",
                                           "2147483647",
                                           "2147483648",
                                           "-2147483648",
                                           "4294967296",
                                           "99999",
                                           "100000",
                                           "100001",
                                           "1e5",
                                           "1e-12",
                                           "1e12",
                                           "0.1",
                                           "0.5",
                                           "1.0000000001",
                                           "0x7fffffff",
                                           "1_000",
                                           "3.5"};
const std::vector<std::string> kTexts = {"\"\"",
                                         "\" \"",
                                         "\"nan m\"",
                                         "\"inf kPa\"",
                                         "\"1e999 m\"",
                                         "\"5 furlongs\"",
                                         "\"5\"",
                                         "\"m\"",
                                         "\"1 m m\"",
                                         "\"-1 mm\"",
                                         "\"0 s\"",
                                         "\"1,5 m\"",
                                         "\"5 m\\n\"",
                                         "\"a b\"",
                                         "\"../x\"",
                                         "\"/dev/zero\"",
                                         "\"a\\u0000b\"",
                                         "\"\\u202e\"",
                                         "\"{}\"",
                                         "\"%s%n\"",
                                         "\"\xC3\xA9\"",
                                         "\"a,b\"",
                                         "\"name.with.dots\"",
                                         "\"free\"",
                                         "\"clamped\"",
                                         "\"rk4\"",
                                         "\"cvode\"",
                                         "\"frozen\"",
                                         "\"six\"",
                                         "'''x'''"};
const std::vector<std::string> kTypes = {
    "true",
    "false",
    "[]",
    "{}",
    "[[]]",
    "[{}]",
    "\"x\"",
    "1979-05-27T07:32:00Z",
    "07:32:00",
    "[1, 2, 3]",
    "[0, 0, 0]",
    "[nan, 0, 1]",
    "[1, \"a\"]",
    "[1, 2]",
    "[\"1 mm\", \"2 s\"]",
    "{ x = 1 }",
    "{ type = \"table\" }",
    "{ type = \"sine\", amplitude = 1e308, frequency = 1e308 }",
    "{ type = \"table\", file = \"nowhere.csv\" }",
    "{ type = \"table\", time = [0, 0], value = [1, 2] }",
    "{ type = \"triangular\", high = 1, period = 1e-300 }",
    ""};
const std::vector<std::string> kKeys = {
    "name",     "x",        "\"\"", "\"a b\"", "\"a\\nb\"", "\"\xC3\xA9\"", "a.b.c",
    "elements", "duration", "step", "extends", "material",  "type",         "file",
    "'k'",      "-",        "1",    "length",  "radius",    "cables",       "control"};
const std::vector<std::string> kBytes = {std::string(1, '\0'),
                                         "\xFF",
                                         "\x80",
                                         "\xC3\x28",
                                         "\r",
                                         "\x1B[31m",
                                         "\x7F",
                                         "\xEF\xBB\xBF",
                                         "\"",
                                         "[",
                                         "]",
                                         "{",
                                         "}",
                                         "=",
                                         ".",
                                         ",",
                                         "#",
                                         "\n",
                                         "\t",
                                         "\\",
                                         "'''",
                                         "\"\"\""};

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

SceneMutants::SceneMutants(std::vector<std::string> scenes, std::uint64_t seed)
    : scenes_(std::move(scenes)), texts_(kTexts), random_(seed) {
  const std::regex pattern(kText);
  for (const std::string& scene : scenes_) {
    for (std::sregex_iterator at(scene.begin(), scene.end(), pattern), end; at != end; ++at) {
      texts_.push_back(at->str());
    }
  }
}

std::string SceneMutants::Next() {
  std::string text = Pick(scenes_);
  changes_.clear();
  for (std::size_t i = 0, many = 1 + Draw(4); i < many; ++i) Mutate(&text);
  return text;
}

void SceneMutants::Mutate(std::string* text) {
  using Change = void (SceneMutants::*)(std::string*);
  // The first ones more often: the others mostly end in the parser.
  static constexpr std::pair<const char*, Change> kChanges[] = {
      {"number", &SceneMutants::ChangeNumber}, {"number", &SceneMutants::ChangeNumber},
      {"number", &SceneMutants::ChangeNumber}, {"number", &SceneMutants::ChangeNumber},
      {"text", &SceneMutants::ChangeText},     {"text", &SceneMutants::ChangeText},
      {"type", &SceneMutants::ChangeType},     {"type", &SceneMutants::ChangeType},
      {"key", &SceneMutants::RenameKey},       {"lines", &SceneMutants::MoveLines},
      {"lines", &SceneMutants::MoveLines},     {"nested", &SceneMutants::Nest},
      {"bytes", &SceneMutants::ChangeBytes}};
  const auto& [name, change] = Pick(kChanges);
  (this->*change)(text);
  changes_ += (changes_.empty() ? "" : ", ") + std::string(name);
}

void SceneMutants::ChangeNumber(std::string* text) {
  const Span at = Find(*text, kNumber);
  std::string number = Pick(kNumbers);
  if (at.size > 0 && Draw(2) == 0) {  // near what it was
    const double factors[] = {0.5, 2, -1, 10, 0.1, 1000, 1e-6, 1.1};
    number = fmt::format("{}", std::strtod(text->c_str() + at.at, nullptr) * Pick(factors));
  }
  text->replace(at.at, at.size, number);
}

void SceneMutants::ChangeText(std::string* text) {
  const Span at = Find(*text, kText);
  text->replace(at.at, at.size,
                Draw(50) == 0 ? '"' + std::string(20'000, 'x') + '"' : Pick(texts_));
}

void SceneMutants::ChangeType(std::string* text) {
  const Span at = Find(*text, kValue);
  text->replace(at.at, at.size, Pick(kTypes));
}

void SceneMutants::RenameKey(std::string* text) {
  const Span at = Find(*text, kKey);
  if (at.size > 0 && Draw(2) == 0) {  // a slip of the pen
    (*text)[at.at + Draw(at.size)] = static_cast<char>('a' + Draw(26));
  } else {
    text->replace(at.at, at.size, Pick(kKeys));
  }
}

void SceneMutants::MoveLines(std::string* text) {
  std::vector<std::string> lines = LinesOf(*text);
  if (lines.empty()) return;
  const std::size_t at = Draw(lines.size());
  switch (Draw(5)) {
    case 0:
      lines.erase(lines.begin() + static_cast<long>(at));
      break;
    case 1:
      lines.insert(lines.begin() + static_cast<long>(at), lines[Draw(lines.size())]);
      break;
    case 2:
      std::swap(lines[at], lines[Draw(lines.size())]);
      break;
    case 3: {
      const std::vector<std::string> other = LinesOf(Pick(scenes_));
      if (!other.empty()) lines.insert(lines.begin() + static_cast<long>(at), Pick(other));
      break;
    }
    default:
      lines.resize(at);
      break;
  }
  text->clear();
  for (const std::string& line : lines) *text += line + "\n";
}

void SceneMutants::Nest(std::string* text) {
  const std::size_t depths[] = {2, 10, 100, 1000, 50'000};
  const std::size_t depth = Pick(depths);
  std::string nested;
  switch (Draw(3)) {
    case 0:
      nested = "x = " + std::string(depth, '[') + std::string(depth, ']') + "\n";
      break;
    case 1:
      nested = "a";
      for (std::size_t i = 1; i < depth; ++i) nested += ".a";
      nested += " = 1\n";
      break;
    default:
      nested = "x = ";
      for (std::size_t i = 0; i < depth; ++i) nested += "{a=";
      nested += "1" + std::string(depth, '}') + "\n";
      break;
  }
  const std::size_t line = text->find('\n', Draw(text->size() + 1));
  text->insert(line == std::string::npos ? 0 : line + 1, nested);
}

void SceneMutants::ChangeBytes(std::string* text) {
  const std::size_t at = Draw(text->size() + 1);
  if (Draw(3) == 0) {
    text->erase(at, 1 + Draw(20));
  } else {
    text->insert(at, Pick(kBytes));
  }
}

std::size_t SceneMutants::Draw(std::size_t below) { return random_() % below; }

SceneMutants::Span SceneMutants::Find(const std::string& text, const char* pattern) {
  // Searched from a random place on, so that long scenes cost no more than short ones; what is too
  // long for one search (nested a thousand times) is passed over.
  constexpr std::size_t kWindow = 600;
  const std::size_t from = Draw(text.size() + 1);
  const std::string window = text.substr(from, kWindow);
  std::smatch match;
  if (!std::regex_search(window, match, std::regex(pattern))) return {text.size(), 0};
  const std::size_t group = match.size() > 1 ? 1 : 0;
  return {from + static_cast<std::size_t>(match.position(group)),
          static_cast<std::size_t>(match.length(group))};
}

}  // namespace mantle::testing_tools
