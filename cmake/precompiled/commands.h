// Precompiled for what reads the command line.
#include <CLI/CLI.hpp>

#include "cmake/precompiled/program.h"
