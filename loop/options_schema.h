#pragma once

#include "loop/options.h"
#include "model/schema.h"

/// @file
/// The keys of the table [drives].

namespace mantle::loop {

void Describe(schema::Visitor& v, DriveOptions& drives);

}  // namespace mantle::loop
