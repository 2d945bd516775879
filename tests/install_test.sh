#!/usr/bin/env bash
# install_test.sh SOURCE BUILD: installs the build into a fresh folder; builds and runs, against what
# was installed and with nothing of the source tree, a program for each component of the package and
# every example.
set -euo pipefail
source=$1 build=$2
work=$build/tests/installed  # the same place every time, so that a compiler cache may hit
rm -rf "$work"
mkdir -p "$work"
cmake --install "$build" --prefix "$work/prefix" >/dev/null

# A public header includes nothing that stays behind.
include=$work/prefix/include/mantle
grep -rhoP '^#include "\K[^"]+' "$include" | sort -u | while read -r header; do
  [ -f "$include/$header" ] || { echo "$header is included by a public header, but not installed"; exit 1; }
done

launcher=()
command -v ccache >/dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
configure() {  # SOURCE BUILD [OPTIONS]
  cmake -S "$1" -B "$2" -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" "${launcher[@]}" "${@:3}" \
    >"$work/configure.log" 2>&1 || { cat "$work/configure.log"; exit 1; }
}
make() {  # BUILD
  cmake --build "$1" >"$work/build.log" || { cat "$work/build.log"; exit 1; }
}

config=$(find "$work/prefix" -name mantleConfig.cmake)
components=$(sed -n 's/^set(mantle_COMPONENTS \(.*\))$/\1/p' "$config")
for component in ${components//;/ }; do
  [ -f "$source/tests/install/$component.cc" ] || {
    echo "tests/install/$component.cc is missing: a program that uses the component"; exit 1; }
done
configure "$source/tests/install" "$work/install" -DCOMPONENTS="$components"
make "$work/install"
for component in ${components//;/ }; do
  "$work/install/use_$component" || { echo "use_$component: exit status $?"; exit 1; }
done

# A component that is none is refused with those that are.
mkdir "$work/none"
printf '%s\n' 'cmake_minimum_required(VERSION 3.22)' 'project(none CXX)' \
  'find_package(mantle REQUIRED COMPONENTS nonsense)' >"$work/none/CMakeLists.txt"
! cmake -S "$work/none" -B "$work/none/build" -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" >"$work/none.log" 2>&1
grep -q 'component nonsense: is none, must be one of' "$work/none.log" || { cat "$work/none.log"; exit 1; }

# Examples: copied, as a user would. The comment `// Prints:` says what must come out.
cp -r "$source/examples" "$work/examples"
configure "$work/examples" "$work/example"
make "$work/example"
scenes=$work/prefix/share/mantle/scenes
for file in "$work"/examples/*.cc; do
  name=$(basename "$file" .cc)
  arguments=$(sed -n 's|^// Run: *[^ ]* *||p' "$file")
  expected=$(sed -n 's|^// Prints: *||p' "$file")
  [ -n "$expected" ] || { echo "examples/$name.cc: a line // Prints: REGEX is missing"; exit 1; }
  # shellcheck disable=SC2086  # several arguments
  (cd "$work" && "$work/example/$name" ${arguments//SCENES/$scenes}) >"$work/out.txt" ||
    { echo "examples/$name: exit status $?"; cat "$work/out.txt"; exit 1; }
  grep -E "$expected" "$work/out.txt" || { echo "examples/$name printed, without $expected:"; cat "$work/out.txt"; exit 1; }
done

# The program: its modules beside it, manual pages and completion in their places.
mantle=$work/prefix/bin/mantle
"$mantle" check "$scenes/arm_static.toml" | grep -q arm
"$mantle" run "$scenes/reach.toml" --set time.duration=0.2 --out "$work/out" >/dev/null
"$mantle" log "$work/out/telemetry.lcmlog" | grep -q MANTLE_PLAN
"$mantle" log "$work/out/telemetry.lcmlog" | grep -q MANTLE_SHAPE
if [ -f "$build/report/report.html" ]; then
  "$mantle" report "$work/out" | grep -q '1 run'
  grep -q 'id="mantle-data"' "$work/out/report.html"
fi
# The module for Python, with the program that was installed and nothing of the build.
if ls "$build"/python/mantle/_mantle.*.so >/dev/null 2>&1; then
  (cd "$work" && PYTHONPATH=$work/prefix/lib/python3/dist-packages /usr/bin/python3 - "$work/prefix" <<'END'
import sys
import mantle
from mantle.commands import program
assert mantle.__file__.startswith(sys.argv[1]) and program() == sys.argv[1] + "/bin/mantle", (mantle.__file__, program())
scene = mantle.scene_folder() / "reach.toml"
assert str(scene).startswith(sys.argv[1])
in_process = mantle.closed_loop(scene, {"time.duration": 0.1})
results = mantle.run(scene, {"time.duration": 0.1})
assert (results.trajectory["arm_tip_x_m"] == in_process.trajectory["arm_tip_x_m"]).all()
assert results.log.channel("MANTLE_STATE").rows > 0
END
  )
fi
zcat "$work/prefix/share/man/man1/mantle-run.1.gz" | grep -q -- 'checkpoint'
grep -q '"title": "Mantle scene"' "$work/prefix/share/mantle/scene.schema.json"
[ -f "$work/prefix/share/bash-completion/completions/mantle" ]
mv "$work/prefix/lib/mantle/modules/mantle_ipopt.so" "$work/gone"
status=0
"$mantle" run "$scenes/reach.toml" --set time.duration=0.2 --out "$work/out2" >/dev/null 2>"$work/err.txt" || status=$?
[ "$status" = 1 ] && grep -q "$work/prefix/lib/mantle/modules/mantle_ipopt.so: is missing" "$work/err.txt" ||
  { echo "without its solver: exit status $status"; cat "$work/err.txt"; exit 1; }
