// Precompiled for the program, but for what reads the command line.
#include <iostream>
#include <nlohmann/json.hpp>

#include "cmake/precompiled/libraries.h"
