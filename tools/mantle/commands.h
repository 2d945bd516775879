#pragma once

/// The subcommands of the program `mantle`. Each Add...Command registers one subcommand with its
/// options and a callback; the callback stores the exit status (exit_status.h).

#include <CLI/CLI.hpp>

#include "tools/mantle/bad_input.h"
#include "tools/mantle/exit_status.h"

namespace mantle::tools {

/// `mantle run`: a scene in time.
void AddRunCommand(CLI::App& app, int& exit_status);
/// `mantle compare`: the full and the reduced model side by side.
void AddCompareCommand(CLI::App& app, int& exit_status);
/// `mantle study`: many runs side by side.
void AddStudyCommand(CLI::App& app, int& exit_status);
/// `mantle static`: a scene's equilibrium.
void AddStaticCommand(CLI::App& app, int& exit_status);
/// `mantle modes`: linearised motions about a shape at rest.
void AddModesCommand(CLI::App& app, int& exit_status);
/// `mantle check`: what is active and what it will cost.
void AddCheckCommand(CLI::App& app, int& exit_status);
/// `mantle bus`: watches a bus, counts its load, replays logs.
void AddBusCommand(CLI::App& app, int& exit_status);
/// `mantle log`: what is in a telemetry log.
void AddLogCommand(CLI::App& app, int& exit_status);
/// `mantle report`: results as one page to look at.
void AddReportCommand(CLI::App& app, int& exit_status);
/// `mantle export`: results for other programs.
void AddExportCommand(CLI::App& app, int& exit_status);
/// `mantle live`: a run as it goes, in a browser.
void AddLiveCommand(CLI::App& app, int& exit_status);
/// `mantle drives`: N winch drives alone on a bus, in real time.
void AddDrivesCommand(CLI::App& app, int& exit_status);
/// `mantle plant`, `mantle control`: the two sides of a loop as programs, in real time;
/// `mantle hil`: both of them, and a recorder.
void AddPlantCommand(CLI::App& app, int& exit_status);
void AddControlCommand(CLI::App& app, int& exit_status);
void AddHilCommand(CLI::App& app, int& exit_status);
/// `mantle tune`: the best parameters of the baseline controllers.
void AddTuneCommand(CLI::App& app, int& exit_status);

}  // namespace mantle::tools
