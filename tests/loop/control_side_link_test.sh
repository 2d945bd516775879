#!/usr/bin/env bash
# control_side_link_test.sh PROGRAM CONTROL_SIDE.a PLANT_SIDE.a: the control side does not reach the
# plant by link. PROGRAM (control_side_alone.cc), which links the control side alone, runs and has
# nothing of the plant side, of a drive or of the full model in it, and links no SUNDIALS.
set -euo pipefail
program=$1 control=$2 plant=$3
vehicle='mantle::loop::(PlantSide|Instruments|SensorModel|DriveRack|MakeReel|DrumTension|LockStep|ClosedLoop)|mantle::firmware_sim::(Drive|Winch|Winding|Motion|PowerStage)::'
full='mantle::model::(Plant::|Simulation::|MakeStepper|EnergyAccount|PlantWork|PlantState|SolveStatics)|mantle::reduced::(ReducedPlant|Projection)'

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
absent "the control side reaches the full model" "$full" "$program"
absent "the control side reaches the plant side" "$vehicle" "$control"
absent "the control side reaches the full model" "$full" "$control"
if ldd "$program" | grep -i sundials; then
  echo "$program links the library above"
  exit 1
fi

# The patterns find what they are for.
for pattern in "$vehicle" "$full"; do
  symbols "$plant" | grep -E "$pattern" >/dev/null || { echo "$plant has nothing of $pattern"; exit 1; }
done
