#include <exception>
#include <iostream>

#include "tools/mantle/commands.h"

int main(int argc, char** argv) {
  CLI::App app{"Mantle: soft underwater vehicles, from the full model to motors on a bus."};
  app.require_subcommand(1);
  app.set_version_flag("--version", MANTLE_VERSION);
  int exit_status = 0;
  mantle::tools::AddBusCommand(app, exit_status);
  mantle::tools::AddDrivesCommand(app, exit_status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int status = app.exit(error);
    return status == 0 ? 0 : mantle::tools::kExitBadInput;
  } catch (const std::exception& error) {
    std::cerr << "mantle: " << error.what() << "\n";
    return 1;
  }
  return exit_status;
}
