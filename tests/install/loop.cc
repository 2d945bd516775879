// A closed loop of half a second, through drives, with plans.
#include "loop/closed_loop.h"

int main() {
  using namespace mantle;
  const auto scene = scene::LoadScene(SCENES "/reach.toml", {"time.duration=0.5"});
  loop::ClosedLoop loop(scene);
  const loop::LoopResult result = loop.Run();
  return result.ok && result.time_s > 0.49 ? 0 : 1;
}
