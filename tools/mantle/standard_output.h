#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>
#include <utility>

/// The one way to standard output and standard error. What cannot be written to standard output
/// ends the command with exit status 1; a complaint is one line, whatever it quotes.

namespace mantle::tools {

/// Standard output cannot be written: exit status 1.
struct CannotPrint : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Makes sure that descriptors 0, 1 and 2 are open, so that no file that is opened later takes the
/// place of a closed one, and that a reader that leaves or a file-size limit is an error of the
/// write instead of a signal that ends the process. Call it first.
void PrepareStandardStreams();

/// Throws CannotPrint where the buffer had to be written and could not.
void PrintText(std::string_view text);
/// The same at the end of a command that ends with `status`: where that is not 0 it is worse than
/// output that cannot be written, has been said, and stands.
void PrintText(std::string_view text, int status);

template <typename... Args>
void Print(fmt::format_string<Args...> format, Args&&... args) {
  PrintText(fmt::format(format, std::forward<Args>(args)...));
}

/// Hands over what is buffered. Throws CannotPrint.
void FlushOutput();

/// Writes "speaker: text" to standard error as one line: control characters of what `text` quotes
/// are shown as `\n`, `\t` or `\xNN`, and a text that is too long to be read is cut.
void ComplainText(std::string_view text, std::string_view speaker = "mantle");

template <typename... Args>
void Complain(fmt::format_string<Args...> format, Args&&... args) {
  ComplainText(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace mantle::tools
