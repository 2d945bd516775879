#pragma once

#include <string>
#include <string_view>

#include "loop/scene/catalogue.h"

/// @file
/// The key tables of docs/scene.md. A place on the page where a table stands begins with a line
///
///   <!-- keys: time output -->
///
/// that names its parts ("scene" for the keys of the whole scene, tables of the scene, and tables
/// that stand in several places, such as "pose"), and ends with `<!-- end of keys -->`.

namespace mantle::scene {

/// The table of the parts, as Markdown. Throws std::invalid_argument for a part that is none.
std::string KeyTable(const Catalogue& catalogue, std::string_view parts);

/// `page` with every key table written anew. Throws std::invalid_argument where a table is not
/// ended, or a part of the catalogue stands in no table or in two.
std::string WithKeyTables(const Catalogue& catalogue, std::string_view page);

}  // namespace mantle::scene
