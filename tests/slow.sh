#!/usr/bin/env bash
# Runs the tests that `cargo test` leaves out, one process each, and prints a table: seconds of processor time, outcome, name.
#   tests/slow.sh            all but those that take hours
#   tests/slow.sh slow       those that take long
#   tests/slow.sh data       those that read published tasks and recordings in ../shared
#   tests/slow.sh long       those that take hours: thousands of draws
#   tests/slow.sh all WORD   those whose name holds a word
# LIMIT_S, 600 if unset, ends a test that takes longer (those of `long` want more). Fails if one of them failed.
set -uo pipefail
cd "$(dirname "$0")/.."
kind=${1:-all} word=${2:-} failed=0 passed=0
TIMEFORMAT='%U %S'

cargo test --locked --no-run --message-format=json 2>/dev/null |
  sed -n 's/.*"target":{"kind":\["test"\].*"src_path":"\([^"]*\)".*"executable":"\([^"]*\)".*/\1 \2/p' >/tmp/descry-slow.$$
trap 'rm -f /tmp/descry-slow.$$*' EXIT
[ -s /tmp/descry-slow.$$ ] || { echo "the tests do not build" >&2; exit 1; }

# The reason that stands above a test says what kind it is; what only makes files is no test.
reason() { grep -rhs -B3 -E "fn ${1##*::}\(" "$2" | grep -oE '#\[ignore = "[a-z]+' | tail -n 1 | grep -oE '[a-z]+$'; }

printf '%9s  %-6s  %s\n' 'seconds' '' 'test'
while read -r source program; do
  crate=$(cd "$(dirname "$source")" && while [ ! -f Cargo.toml ]; do cd ..; done; pwd)
  while read -r name; do
    is=$(reason "$name" "$crate")
    [ "$is" = makes ] && continue
    if [ "$kind" = all ]; then [ "$is" = long ] && continue; else [ "$kind" = "$is" ] || continue; fi
    case "$name" in *"$word"*) ;; *) continue ;; esac
    { time (cd "$crate" && exec timeout "${LIMIT_S:-600}" "$program" --ignored --exact "$name" >/tmp/descry-slow.$$.out 2>&1 </dev/null); } 2>/tmp/descry-slow.$$.time
    if [ $? -eq 0 ]; then outcome=ok passed=$((passed + 1)); else outcome=FAILED failed=$((failed + 1)); fi
    printf '%9.1f  %-6s  %s::%s\n' "$(awk '{print $1 + $2}' /tmp/descry-slow.$$.time)" "$outcome" "$(basename "$crate")" "$name"
    [ $outcome = ok ] || tail -n 15 /tmp/descry-slow.$$.out
  done < <(cd "$crate" && "$program" --ignored --list 2>/dev/null </dev/null | sed -n 's/: test$//p')
done </tmp/descry-slow.$$
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
