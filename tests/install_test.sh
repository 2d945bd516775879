#!/usr/bin/env bash
# install_test.sh SOURCE BUILD: installs the build into a fresh folder, builds the example against it
# with find_package(mantle), and runs it.
set -euo pipefail
source=$1 build=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/prefix" >/dev/null
cmake -S "$source/examples" -B "$work/example" -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
cmake --build "$work/example" >/dev/null
"$work/example/first_arm" | grep -E '^tip at .* after 2\.0 s'
cmp "$build/scene.schema.json" "$work/prefix/share/mantle/scene.schema.json"
"$work/prefix/bin/mantle" check "$work/prefix/share/mantle/scenes/arm_static.toml" | grep -q arm
