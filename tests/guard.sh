#!/usr/bin/env bash
# Counts the instructions of the main paths with valgrind, and holds them against the accepted figures in guard.tsv:
# fails if one takes over 5 % more. Counts depend on the compiler, so figures of another one are not compared.
#   tests/guard.sh          counts and compares
#   tests/guard.sh accept   writes guard.tsv anew
set -euo pipefail
cd "$(dirname "$0")/.."
command -v valgrind >/dev/null || { echo "valgrind is needed: apt-get install valgrind" >&2; exit 2; }
cargo build --release --locked --quiet
descry=$(realpath "${CARGO_TARGET_DIR:-target}/release/descry") tree=$PWD figures=$PWD/tests/guard.tsv
work=$(mktemp -d) compiler=$(rustc --version)
trap 'rm -rf "$work"' EXIT
export RAYON_NUM_THREADS=1
cd "$work"

count() { # the words of a command; what it answers is not looked at here
  { valgrind --tool=callgrind --callgrind-out-file=/dev/null "$descry" "$@" 2>&1 >/dev/null || true; } | sed -n 's/.*Collected : //p'
}

failed=0
accepted_with=$(sed -n 's/^# //p' "$figures" 2>/dev/null || true)
printf '# %s\n' "$compiler" >new.tsv
printf '%14s  %14s  %7s  %s\n' instructions accepted change command
while read -r line; do
  eval "words=(${line//TREE/$tree})"
  counted=$(count "${words[@]}")
  printf '%s\t%s\n' "$counted" "$line" >>new.tsv
  accepted=$(awk -F '\t' -v line="$line" '$2 == line { print $1 }' "$figures" 2>/dev/null || true)
  if [ -n "$accepted" ] && [ "$accepted_with" = "$compiler" ]; then
    change=$(awk -v a="$accepted" -v b="$counted" 'BEGIN { printf "%+.1f %%", 100 * (b / a - 1) }')
    awk -v a="$accepted" -v b="$counted" 'BEGIN { exit b > 1.05 * a }' || { failed=1; change="$change !"; }
  else change=new; fi
  printf '%14s  %14s  %7s  %s\n' "$counted" "${accepted:--}" "$change" "$line"
done <<'PATHS'
find 'cup A' --seed 1 --run found
find 'cup A' --scene no-cup-a --seed 1
do 'identify all objects on the table' --seed 1
do 'is the mug on the desk' --domain home --seed 1
replay found
explain found
memory verify found
check home
check TREE/docs/cookbook/courier
plan TREE/docs/cookbook/ferry/domain.pddl TREE/docs/cookbook/ferry/problem.pddl
plan TREE/docs/cookbook/breakfast/domain.pddl TREE/docs/cookbook/breakfast/problem.pddl
plan TREE/docs/cookbook/market/domain.pddl TREE/docs/cookbook/market/problem.pddl
plan TREE/docs/cookbook/wishes/domain.pddl TREE/docs/cookbook/wishes/problem.pddl
fmt TREE/domains/home/domain.pddl --check
PATHS
if [ "${1:-}" = accept ]; then cp new.tsv "$figures"; exit; fi
[ "$accepted_with" = "$compiler" ] || echo "the accepted figures are of ${accepted_with:-no compiler}, these of $compiler: run tests/guard.sh accept"
exit $failed
