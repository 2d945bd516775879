#!/usr/bin/env bash
# control_side_link_test.sh PROGRAM CONTROL_SIDE.a PLANT_SIDE.a: the control side does not reach the
# plant by link. PROGRAM (control_side_alone.cc), which links the control side alone, runs and has
# nothing of the plant side or of a drive in it; the control side's own code names no part of the
# full model, of its stepping or its statics either.
set -euo pipefail
program=$1 control=$2 plant=$3
vehicle='mantle::loop::(PlantSide|Instruments|SensorModel|DriveRack|MakeReel|DrumTension|LockStep|ClosedLoop)|mantle::firmware_sim::(Drive|Winch|Winding|Motion|PowerStage)::'
stepping='mantle::model::(Simulation|Stepper|MakeStepper|Evaluate|Assemble|SolveStatics|Observe|EnergyAccount|PlantWork|PlantState)'

symbols() {  # ARGUMENTS of nm
  nm -C "$@" 2>/dev/null
}
absent() {  # WHAT PATTERN FILE
  if symbols "$3" | grep -E "$2" | head -5 | grep .; then
    echo "$3 has the symbols above: $1"
    exit 1
  fi
}

"$program"
absent "the control side reaches the plant side" "$vehicle" "$program"
absent "the control side reaches the plant side" "$vehicle" "$control"
absent "the control side reaches the full model" "$stepping" "$control"

# The patterns find what they are for.
symbols "$plant" | grep -qE 'mantle::loop::PlantSide' || { echo "$plant has no PlantSide"; exit 1; }
symbols "$plant" | grep -qE "$stepping" || { echo "$plant does not step a plant"; exit 1; }
