#pragma once

#include "model/schema.h"
#include "model/simulation.h"
#include "model/statics.h"

/// @file
/// The keys of a run in time and of statics.

namespace mantle::model {

/// Table [time].
void DescribeTime(schema::Visitor& v, RunSettings& run);
/// Table [output].
void DescribeOutput(schema::Visitor& v, RunSettings& run);
/// Table [statics].
void Describe(schema::Visitor& v, StaticsSettings& statics);

}  // namespace mantle::model
