#pragma once

#include "loop/options.h"
#include "model/schema.h"

/// The keys of the tables [drives] and [mismatch].

namespace mantle::loop {

void Describe(schema::Visitor& v, DriveOptions& drives);
void Describe(schema::Visitor& v, Mismatch& mismatch);

}  // namespace mantle::loop
