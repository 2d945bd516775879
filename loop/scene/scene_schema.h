#pragma once

#include "loop/scene/scene.h"
#include "model/schema.h"

namespace mantle::scene {

/// The keys of a whole scene, put together from what the owners of its parts describe.
void Describe(schema::Visitor& v, Scene& scene);

}  // namespace mantle::scene
