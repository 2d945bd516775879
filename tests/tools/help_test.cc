#include <gtest/gtest.h>

#include <regex>

#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// Names under "Subcommands:" of a command's help.
std::vector<std::string> CommandsOf(const std::filesystem::path& folder, const std::string& path) {
  const Outcome outcome = Mantle(folder, path + " --help");
  EXPECT_EQ(outcome.status, 0) << path;
  std::vector<std::string> names;
  const auto at = outcome.out.find("\nSubcommands:\n");
  if (at == std::string::npos) return names;
  for (const std::string& line : Lines(outcome.out.substr(at))) {
    std::smatch match;
    if (std::regex_match(line, match, std::regex("  ([a-z]+) +\\S.*"))) names.push_back(match[1]);
  }
  return names;
}

// What bash offers for a command line whose last word is being typed.
std::string Completed(const std::filesystem::path& folder, const std::string& words) {
  std::ofstream(folder / "complete.sh")
      << "source '" + tests::BinaryPath("share/bash-completion/completions/mantle'\n")
      << "COMP_WORDS=(mantle " << words << ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
      << "_mantle\necho \"${COMPREPLY[*]}\"\n";
  const Outcome outcome = Mantle(folder, "--version >/dev/null; bash complete.sh");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  return outcome.out;
}

TEST(Help, HasALineForEveryCommand) {
  const auto folder = FreshFolder("help_commands");
  const Outcome outcome = Mantle(folder, "--help");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const std::string& line : Lines(outcome.out)) EXPECT_LE(line.size(), 80u) << line;
  EXPECT_LE(Lines(outcome.out).size(), 36u) << "fits a terminal";
  EXPECT_GE(CommandsOf(folder, "").size(), 9u) << outcome.out;
  EXPECT_NE(outcome.out.find("mantle COMMAND --help"), std::string::npos);
}

TEST(Help, OfACommandTellsTheRest) {
  const auto folder = FreshFolder("help_command");
  const Outcome outcome = Mantle(folder, "run --help");
  EXPECT_NE(outcome.out.find("--checkpoint-every"), std::string::npos);
  EXPECT_NE(outcome.out.find("mantle run scenes/paper.toml --out results"), std::string::npos);
  EXPECT_NE(outcome.out.find("Exit status"), std::string::npos);
  EXPECT_EQ(outcome.out.find("mantle COMMAND --help"), std::string::npos);
}

TEST(Help, EveryCommandHasAManualPageWithEveryOption) {
  const auto folder = FreshFolder("help_manual");
  std::vector<std::string> paths{""};
  for (const std::string& command : CommandsOf(folder, "")) {
    paths.push_back(command);
    for (const std::string& below : CommandsOf(folder, command)) {
      paths.push_back(command + " " + below);
    }
  }
  ASSERT_GE(paths.size(), 13u);
  for (const std::string& path : paths) {
    std::string page = path.empty() ? "mantle" : "mantle " + path;
    page = std::regex_replace(page, std::regex(" "), "-");
    const Outcome manual =
        Mantle(folder, "--version >/dev/null; gzip -dc '" + tests::BinaryPath("share/man/man1/") +
                           page + ".1.gz'");
    ASSERT_EQ(manual.status, 0) << manual.err;
    const std::string text = std::regex_replace(manual.out, std::regex("\\\\-"), "-");
    EXPECT_NE(text.find(".SH NAME\n" + page + " - "), std::string::npos) << text;
    const Outcome help = Mantle(folder, path + " --help");
    const std::regex option("\n  (?:-\\w,)?(--[a-z-]+)");
    for (std::sregex_iterator i(help.out.begin(), help.out.end(), option), end; i != end; ++i) {
      EXPECT_NE(text.find((*i)[1]), std::string::npos) << page << " lacks " << (*i)[1];
    }
  }
}

TEST(Help, BashCompletesCommandsOptionsAndTheirValues) {
  const auto folder = FreshFolder("help_completion");
  EXPECT_EQ(Completed(folder, "ru"), "run\n");
  EXPECT_EQ(Completed(folder, "bus mo"), "monitor\n");
  EXPECT_EQ(Completed(folder, "run --real"), "--realtime\n");
  EXPECT_EQ(Completed(folder, "run a.toml --resu"), "--resume\n");
  EXPECT_EQ(Completed(folder, "run --controller pu"), "pursuit\n");
  EXPECT_EQ(Completed(folder, "run --model \"\""), "full reduced\n");
  EXPECT_EQ(Completed(folder, "run scen"), "\n") << "files are bash's own business";
  EXPECT_EQ(Completed(folder, "study --js"), "\n") << "an option of study control";
  EXPECT_EQ(Completed(folder, "study control --js"), "--json\n");
}

}  // namespace
}  // namespace mantle::testing_tools
