// Precompiled for the test programs.
#include <gtest/gtest.h>

#include "cmake/precompiled/libraries.h"
