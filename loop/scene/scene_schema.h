#pragma once

#include "loop/scene/catalogue.h"
#include "loop/scene/scene.h"
#include "model/schema.h"

namespace mantle::scene {

/// The keys of a whole scene, put together from what the owners of its parts describe.
void Describe(schema::Visitor& v, Scene& scene);

/// Every key that a scene may have.
Catalogue SceneCatalogue();

}  // namespace mantle::scene
