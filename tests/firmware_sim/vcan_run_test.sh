#!/usr/bin/env bash
# tools/vcan_run passes through what the command says and returns. Each check names its claim.
set -uo pipefail
run=$(cd "$(dirname "$0")/../../tools" && pwd)/vcan_run
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
expect() { # CLAIM ACTUAL EXPECTED
  if [ "$2" = "$3" ]; then
    echo "ok: $1"
  else
    echo "FAILED: $1: got '$2', expected '$3'"
    failures=$((failures + 1))
  fi
}

cd "$work"
VALUE='a b' "$run" -t 30 -n 2 -- bash -c '
  echo "$VALUE"; echo oops >&2; pwd
  cat /sys/class/net/vcan0/type /sys/class/net/vcan1/type; cat; exit 7' >out 2>err </dev/zero
expect "exit status passes through" $? 7
expect "stdout, environment, folder and interfaces are there, stdin is empty" \
  "$(cat out)" "$(printf 'a b\n%s\n280\n280' "$work")"
expect "stderr stays apart" "$(cat err)" oops

start=$SECONDS
"$run" -t 1 sleep 60
expect "a time limit ends the command with 124" $? 124
expect "soon" $((SECONDS - start < 40)) 1

"$run" no-such-command 2>/dev/null
expect "an unknown command gives 127" $? 127
"$run" -t x true 2>err
expect "a bad option gives 125" $? 125
expect "and says value and bound" "$(cat err)" "vcan_run: -t 'x' is not a number of seconds, 1 or more"
exit $((failures > 0))
