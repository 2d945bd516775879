#pragma once

#include <string>
#include <string_view>

/// @file
/// Texts that users give: what may stand in a scene and how a message shows it.

namespace mantle::scene {

/// Valid UTF-8: shortest forms, no surrogates, at most U+10FFFF.
bool IsUtf8(std::string_view text);

/// Made of letters, digits, "_" and "-", not empty: can stand in a column's title.
bool IsName(std::string_view text);

/// `text` with every byte that a name may not hold replaced by "_"; "scene" where it is empty.
std::string NameFrom(std::string_view text);

/// Letters added, left out, changed, or swapped with their neighbour, that lead from a to b
/// (optimal string alignment).
int EditDistance(std::string_view a, std::string_view b);

/// For a message of one line: at most 120 bytes, control characters and bytes that are not UTF-8
/// as `\xNN`.
std::string Printable(std::string_view text);

}  // namespace mantle::scene
