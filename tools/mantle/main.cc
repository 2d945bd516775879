#include <sstream>
#include <string>

#include "mantle/version.h"
#include "tools/mantle/commands.h"
#include "tools/mantle/help.h"
#include "tools/mantle/module.h"
#include "tools/mantle/process.h"
#include "tools/mantle/standard_output.h"

int main(int argc, char** argv) {
  using namespace mantle::tools;
  PrepareStandardStreams();
  UseOneBlasThread();
  KeepFreedMemory();
  mantle::controller::SetSolverFactory(MakeModuleSolver);
  CLI::App app{
      "Mantle: soft underwater vehicles, from the full model to motors on a bus.\n\n"
      "Start with:  mantle check scenes/paper.toml\n"
      "             mantle run scenes/steer.toml --out results"};
  app.name("mantle");
  app.formatter(std::make_shared<BriefFormatter>());
  app.require_subcommand(1);
  app.set_version_flag("--version", mantle::kVersion);
  int exit_status = 0;
  AddRunCommand(app, exit_status);
  AddCompareCommand(app, exit_status);
  AddStaticCommand(app, exit_status);
  AddModesCommand(app, exit_status);
  AddCheckCommand(app, exit_status);
  AddBusCommand(app, exit_status);
  AddDrivesCommand(app, exit_status);
  AddHilCommand(app, exit_status);
  AddPlantCommand(app, exit_status);
  AddControlCommand(app, exit_status);
  AddLogCommand(app, exit_status);
  AddStudyCommand(app, exit_status);
  AddTuneCommand(app, exit_status);
  AddReportCommand(app, exit_status);
  AddExportCommand(app, exit_status);
  AddLiveCommand(app, exit_status);
  app.footer("mantle COMMAND --help tells the rest.");
  app.add_option_function<std::string>(
         "--write-shell-files",
         [&app](const std::string& share) {
           WriteShellFiles(app, share);
           throw CLI::Success();
         },
         "Write manual pages and shell completion below this folder")
      ->group("")  // for the build
      ->trigger_on_parse();
  return StatusOf([&] {
    try {
      app.parse(argc, argv);
    } catch (const CLI::Success& help) {
      std::ostringstream text, nothing;
      app.exit(help, text, nothing);
      PrintText(text.str());
      return 0;
    } catch (const CLI::ParseError& error) {
      throw BadInput(std::string(error.what()) + " (mantle --help lists the commands)");
    }
    return exit_status;
  });
}
