#include "tools/mantle/help.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <regex>
#include <stdexcept>

#include "mantle/version.h"

namespace mantle::tools {
namespace {

constexpr std::size_t kLine = 64;    // characters of a Brief
constexpr std::size_t kColumn = 10;  // of a command's name
constexpr const char* kSection = "1";

using Visit = std::function<void(const CLI::App&, const std::string& path)>;

std::vector<const CLI::App*> Commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_name().empty(); });
}

// The program and every command, with its path: "", "run", "bus", "bus monitor" ...
void VisitCommands(const CLI::App& app, const std::string& path, const Visit& visit) {
  visit(app, path);
  for (const CLI::App* command : Commands(app)) {
    const std::string name = command->get_name();
    VisitCommands(*command, path.empty() ? name : path + " " + name, visit);
  }
}

std::vector<const CLI::Option*> Options(const CLI::App& app, bool positional) {
  return app.get_options([positional](const CLI::Option* option) {
    return option->get_positional() == positional && !option->get_group().empty();
  });
}

std::string Joined(const std::vector<std::string>& words, const char* between) {
  return fmt::format("{}", fmt::join(words, between));
}

// The values of an option that has a list of them: CLI11 shows them as TYPE:{a,b}.
std::string Choices(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  std::string values = type.substr(begin + 1, end - begin - 1);
  std::replace(values.begin(), values.end(), ',', ' ');
  return values;
}

// Text as man shows it: no line begins with a control character, no backslash or hyphen is lost.
std::string Escaped(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool line_begins = i == 0 || text[i - 1] == '\n';
    if (line_begins && (text[i] == '.' || text[i] == '\'')) out += "\\&";
    if (text[i] == '\\') {
      out += "\\e";
    } else if (text[i] == '-') {
      out += "\\-";
    } else {
      out += text[i];
    }
  }
  return out;
}

// Paragraphs; lines that begin with two spaces keep their form.
std::string Paragraphs(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  bool example = false;
  for (std::string line; std::getline(lines, line);) {
    const bool now = line.starts_with("  ");
    if (now != example) out += now ? ".PP\n.EX\n" : ".EE\n.PP\n";
    example = now;
    if (line.empty()) {
      if (!out.ends_with(".PP\n")) out += ".PP\n";
    } else {
      out += Escaped(line) + "\n";
    }
  }
  if (example) out += ".EE\n";
  while (out.ends_with(".PP\n")) out.resize(out.size() - 4);
  return out;
}

std::string OptionEntry(const CLI::Option& option) {
  const std::string name =
      option.get_positional() ? option.get_name(true) : option.get_name(false, true);
  const std::string type = option.get_type_size() == 0 ? "" : option.get_type_name();
  std::string term = ".TP\n.B " + Escaped(std::regex_replace(name, std::regex(","), ", "));
  if (!type.empty() && !option.get_positional()) term += " \\fI" + Escaped(type) + "\\fR";
  return term + "\n" + Escaped(option.get_description()) + "\n";
}

}  // namespace

std::string Brief(const CLI::App& command) {
  std::string text = command.get_description();
  const auto cut = [&text](const char* mark) {
    text.resize(std::min(text.find(mark), text.size()));
  };
  cut("\n\n");
  text = std::regex_replace(text, std::regex("\\s*\n\\s*"), " ");
  cut(". ");
  for (const char* mark : {";", " (", ":", ","}) {
    if (text.size() > kLine) cut(mark);
  }
  while (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.pop_back();
  return text;
}

std::string BriefFormatter::make_subcommand(const CLI::App* command) const {
  return fmt::format("  {:<{}}{}\n", command->get_name(), kColumn, Brief(*command));
}

std::string ManualPage(const CLI::App& command, const std::string& path) {
  std::string name = path.empty() ? "mantle" : "mantle " + path;
  std::string page_name = std::regex_replace(name, std::regex(" "), "-");
  std::string title = page_name;
  std::transform(title.begin(), title.end(), title.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  std::string page =
      fmt::format(".TH {} {} \"\" \"Mantle {}\" \"Mantle\"\n", title, kSection, kVersion);
  page += fmt::format(".SH NAME\n{} \\- {}\n", Escaped(page_name), Escaped(Brief(command)));
  page += fmt::format(".SH SYNOPSIS\n.B {}\n", name);
  const auto commands = Commands(command);
  if (!commands.empty()) page += ".I COMMAND\n";
  page += "[\\fIOPTIONS\\fR]";
  for (const CLI::Option* option : Options(command, true)) page += " " + option->get_name(true);
  page += "\n.SH DESCRIPTION\n" + Paragraphs(command.get_description());
  if (!commands.empty()) page += ".SH COMMANDS\n";
  for (const CLI::App* c : commands) {
    page += fmt::format(".TP\n.B {}\n{}; see\n.BR {}\\-{} ({})\n", c->get_name(),
                        Escaped(Brief(*c)), Escaped(page_name), c->get_name(), kSection);
  }
  page += ".SH OPTIONS\n";
  for (const bool positional : {true, false}) {
    for (const CLI::Option* option : Options(command, positional)) page += OptionEntry(*option);
  }
  const std::string footer = command.get_footer();
  if (!footer.empty()) page += ".SH NOTES\n" + Paragraphs(footer);
  page +=
      ".SH EXIT STATUS\n.TP\n.B 0\ndone\n.TP\n.B 1\nstandard output could not be written, or an "
      "internal fault\n.TP\n.B 2\nbad input, nothing changed\n.TP\n.B 3\nit could not go on, or "
      "was "
      "interrupted; what was reached is kept as *.partial\n";
  return page;
}

std::string BashCompletion(const CLI::App& program) {
  std::string words, values;
  VisitCommands(program, "", [&](const CLI::App& command, const std::string& path) {
    std::vector<std::string> names;
    for (const CLI::App* c : Commands(command)) names.push_back(c->get_name());
    for (const CLI::Option* option : Options(command, false)) {
      for (const std::string& name : option->get_lnames()) {
        names.push_back("--" + name);
        const std::string choices = Choices(*option);
        if (!choices.empty()) {
          values += fmt::format("    '{} --{}') words='{}' ;;\n", path, name, choices);
        }
      }
    }
    words += fmt::format("    '{}') words='{}' ;;\n", path, Joined(names, " "));
  });
  std::string groups;  // commands that have commands: a second word belongs to the path
  VisitCommands(program, "", [&](const CLI::App& command, const std::string& path) {
    if (!path.empty() && !Commands(command).empty()) groups += (groups.empty() ? "" : "|") + path;
  });
  return fmt::format(R"(# Completion of `mantle` for bash, written from the program's own options.
_mantle() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} path='' words='' i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case ${{COMP_WORDS[i]}} in -*) break ;; esac
    case $path in
      '') path=${{COMP_WORDS[i]}} ;;
      {}) path="$path ${{COMP_WORDS[i]}}" ;;
    esac
  done
  case "$path $previous" in
{}  esac
  if [[ -z $words && ( $current == -* || -z $path || $path == @({}) ) ]]; then
    case $path in
{}    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _mantle mantle
)",
                     groups, values, groups, words);
}

void WriteShellFiles(const CLI::App& program, const std::filesystem::path& share) {
  const auto write = [&](const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream out(file);
    out << text << std::flush;
    if (!out) throw std::runtime_error(file.string() + ": cannot be written");
  };
  VisitCommands(program, "", [&](const CLI::App& command, const std::string& path) {
    const std::string name = path.empty() ? "mantle" : "mantle " + path;
    write(share / "man" / "man1" / (std::regex_replace(name, std::regex(" "), "-") + ".1"),
          ManualPage(command, path));
  });
  write(share / "bash-completion" / "completions" / "mantle", BashCompletion(program));
}

}  // namespace mantle::tools
