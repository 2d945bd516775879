#include <exception>
#include <iostream>

#include "model/rod.h"
#include "model/toml_document.h"
#include "tools/mantle/commands.h"
#include "tools/mantle/process.h"

int main(int argc, char** argv) {
  using namespace mantle::tools;
  UseOneBlasThread();
  CLI::App app{
      "Mantle: soft underwater vehicles, from the full model to motors on a bus.\n\n"
      "Start with:  mantle check scenes/paper.toml\n"
      "             mantle run scenes/steer.toml --out results"};
  app.name("mantle");
  app.require_subcommand(1);
  app.set_version_flag("--version", MANTLE_VERSION);
  int exit_status = 0;
  AddRunCommand(app, exit_status);
  AddCompareCommand(app, exit_status);
  AddStaticCommand(app, exit_status);
  AddModesCommand(app, exit_status);
  AddCheckCommand(app, exit_status);
  AddBusCommand(app, exit_status);
  AddDrivesCommand(app, exit_status);
  AddLogCommand(app, exit_status);
  AddStudyCommand(app, exit_status);
  AddTuneCommand(app, exit_status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "mantle: " << error.what() << " (mantle --help lists the commands)\n";
    return kExitBadInput;
  } catch (const BadInput& error) {
    std::cerr << "mantle: " << error.what() << "\n";
    return kExitBadInput;
  } catch (const mantle::model::BadScene& error) {
    std::cerr << "mantle: " << error.what() << "\n";
    return kExitBadInput;
  } catch (const std::exception& error) {
    std::cerr << "mantle: " << error.what() << "\n";
    return 1;
  }
  return exit_status;
}
