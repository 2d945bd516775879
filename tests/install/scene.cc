// A scene that comes with the package.
#include "loop/scene/scene.h"

int main() {
  const auto scene = mantle::scene::LoadScene(SCENES "/steer.toml", {"time.duration=2"});
  return scene.control && scene.run.duration_s == 2.0 ? 0 : 1;
}
