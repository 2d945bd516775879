#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/paths.h"

/// Runs the built program `mantle` and reads what it wrote.

namespace mantle::testing_tools {

struct Outcome {
  int status;
  std::string out, err;
};

inline std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// A fresh, empty folder of this test.
inline std::filesystem::path FreshFolder(const std::string& name) {
  const std::filesystem::path folder =
      std::filesystem::path(tests::BinaryPath("tests")) / "work" / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

/// The built program, quoted for the shell.
inline std::string Program() { return "'" + tests::BinaryPath("mantle") + "'"; }

/// `arguments` go through the shell; standard error is caught in `folder`.
inline Outcome Mantle(const std::filesystem::path& folder, const std::string& arguments) {
  const std::filesystem::path err = folder / "stderr.txt";
  const std::string command = "cd '" + folder.string() + "' || exit 9; { " + Program() + " " +
                              arguments + "; } 2>stderr.txt";
  Outcome outcome{-1, {}, {}};
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  char buffer[4096];
  while (const std::size_t n = std::fread(buffer, 1, sizeof buffer, pipe))
    outcome.out.append(buffer, n);
  const int status = pclose(pipe);
  outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.err = ReadFile(err);
  std::filesystem::remove(err);
  return outcome;
}

/// What was said on standard error apart from warnings, and the number of these: a warning is one
/// line that begins with "mantle: warning: ".
struct Said {
  std::string complaints;
  int warnings{0};
};
inline Said SaidOf(const std::string& err) {
  Said said;
  std::istringstream in(err);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("mantle: warning: ", 0) == 0) {
      ++said.warnings;
    } else {
      said.complaints += line + "\n";
    }
  }
  return said;
}

inline nlohmann::json ReadJson(const std::filesystem::path& path) {
  return nlohmann::json::parse(ReadFile(path));
}

/// Rows of cells, the titles first.
inline std::vector<std::vector<std::string>> ReadCsv(const std::filesystem::path& path) {
  std::istringstream in(ReadFile(path));
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(in, line);) {
    rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

inline std::string Scene(const std::string& name) {
  return "'" + tests::SourcePath("scenes/") + name + ".toml'";
}

}  // namespace mantle::testing_tools
