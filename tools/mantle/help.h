#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

/// What the program says about itself, from one source: the tree of its commands and options.
/// `mantle --help` has a line for each command, `mantle COMMAND --help` the rest; manual pages and
/// the completion for bash are written from the same tree when Mantle is built.

namespace mantle::tools {

/// The first sentence of a command's description, cut where it runs beyond a line.
std::string Brief(const CLI::App& command);

/// Lists commands by their Brief. Set it before commands are added: they inherit it.
class BriefFormatter : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override;
};

/// The manual page of the program (`path` empty) or of a command, e.g. path "bus monitor", in man's
/// macros (man(7)).
std::string ManualPage(const CLI::App& command, const std::string& path);

/// A completion script for bash: commands, options, and the values of options that have a list of
/// them; files elsewhere.
std::string BashCompletion(const CLI::App& program);

/// Writes man/man1/mantle.1, man/man1/mantle-run.1 ... and bash-completion/completions/mantle below
/// `share`. Throws std::runtime_error where a file cannot be written.
void WriteShellFiles(const CLI::App& program, const std::filesystem::path& share);

}  // namespace mantle::tools
