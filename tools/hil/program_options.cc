#include "tools/hil/program_options.h"

#include <fmt/format.h>

#include <stdexcept>
#include <system_error>
#include <vector>

#include "firmware_sim/bus/open_bus.h"
#include "firmware_sim/master/master.h"
#include "tools/mantle/build_run.h"
#include "tools/mantle/lcm_bridge.h"

namespace mantle::tools {

scene::Scene ProgramOptions::Load() const {
  scene::Scene loaded = scene.Load();
  if (!loaded.control) {
    throw scene::BadScene(scene.scene_file +
                          ": control: table is missing: a vehicle that is controlled needs it");
  }
  DemandTime(scene, loaded, "mantle hil");
  return loaded;
}

std::string ProgramOptions::Bus(const scene::Scene& loaded) const {
  if (!bus.empty()) return bus;
  return loaded.drives.bus == "loop" ? kHilBus : loaded.drives.bus;
}

void AddProgramOptions(CLI::App* command, ProgramOptions* options) {
  AddSceneOptions(command, &options->scene);
  command
      ->add_option("--bus", options->bus,
                   fmt::format("{}; default: the scene's, or where that is in process {}",
                               firmware_sim::kSharedBusSpecHelp, kHilBus))
      ->type_name("SPEC");
  command->add_option("--lcm", options->lcm, std::string("Sensors and telemetry: ") + kLcmUrlHelp)
      ->type_name("URL")
      ->capture_default_str();
}

std::unique_ptr<firmware_sim::Bus> OpenStation(const std::string& spec, bool master) {
  const std::vector<firmware_sim::CanFilter> filters =
      master ? firmware_sim::Master::Filters() : std::vector<firmware_sim::CanFilter>{};
  try {
    return firmware_sim::OpenBus(spec, nullptr, filters);
  } catch (const std::invalid_argument& error) {
    throw BadInput(std::string("--bus: ") + error.what());
  } catch (const std::system_error& error) {
    throw BadInput(std::string("--bus: ") + error.what());
  }
}

}  // namespace mantle::tools
