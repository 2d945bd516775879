// Precompiled for the program.
#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cmake/precompiled/libraries.h"
