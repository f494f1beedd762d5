# SPDX-License-Identifier: Apache-2.0
# The command itself: its version, its help, and the programs that it becomes.
source "$(dirname "$0")/lib.sh" "$@"

expect 0 "" "$takt"
grep -q "^Subcommands:" "$work/stdout" || fail "without arguments there is no help"
"$takt" --help | cmp -s - "$work/stdout" || fail "takt without arguments is not takt --help"
expect 0 "" "$takt" --version
grep -qE "^takt [0-9]+\.[0-9]+\.[0-9]+ \(commit .+\)$" "$work/stdout" || fail "no version: $(cat "$work/stdout")"
grep -qE "^ABI: declarations=.*;compiler=.*;NDEBUG=" "$work/stdout" || fail "no ABI: $(cat "$work/stdout")"

# A program of the user's, in PATH: with its own arguments, exit code and name.
mkdir "$work/bin"
printf '#!/bin/sh\necho "$0 has $# arguments: $*"\nexit 7\n' >"$work/bin/takt-hello"
chmod +x "$work/bin/takt-hello"
expect 7 "" env PATH="$work/bin:$PATH" "$takt" hello --for "two words"
grep -qxF "$work/bin/takt-hello has 2 arguments: --for two words" "$work/stdout" || fail "takt-hello got: $(cat "$work/stdout")"
printf 'no program\n' >"$work/bin/takt-hello"
expect 3 "takt-hello cannot be started: Exec format error" env PATH="$work/bin:$PATH" "$takt" hello
chmod -x "$work/bin/takt-hello"
expect 2 "there is no command \`hello\`" env PATH="$work/bin:$PATH" "$takt" hello

expect 2 "did you mean \`replay\`?" "$takt" repaly
expect 2 "did you mean \`eval\`?" "$takt" evil
expect 2 "no program takt-../bin/ls" "$takt" ../bin/ls
expect 2 "" "$takt" ""

# The desk commands: each is a link to its program, which may be absent.
for name in bench calibrate cloud eval objects terrain train; do
  program=$(dirname "$takt")/takt-$name
  [ -x "$program" ] || { echo "NOT RUN: $program is not built"; continue; }
  expect 0 "" "$takt" $name --help
done
cp "$takt" "$work/takt"
for name in bench calibrate cloud eval objects terrain train; do
  expect 3 "fix: \`./takt $name\` of a checkout builds it" env PATH=/usr/bin:/bin "$work/takt" $name
done

# The launcher of a checkout, with programs that only tell their arguments: those that are a command are not told its name.
checkout=$work/checkout build=$work/checkout/build
mkdir -p "$checkout/stubs" "$build/graph/command" "$build/bench"
cp "$source/takt" "$checkout/takt" && echo bash >"$checkout/packages.txt"
for tool in cmake ninja; do printf '#!/bin/sh\n' >"$checkout/stubs/$tool"; done
for program in graph/command/{takt,takt-tools,takt-eval,takt-web} bench/takt-bench; do
  printf '#!/bin/sh\necho "${0##*/}: $*"\n' >"$build/$program"
done
chmod +x "$checkout"/stubs/* "$build"/graph/command/* "$build"/bench/*
becomes() { # WORDS-OF-THE-PROGRAM ARGUMENTS...
  local wanted=$1
  shift
  expect 0 "" env PATH="$checkout/stubs:$PATH" TAKT_BUILD="$build" "$checkout/takt" "$@"
  [ "$(cat "$work/stdout")" = "$wanted" ] || fail "./takt $* became '$(cat "$work/stdout")' instead of '$wanted'"
}
for name in bench eval web; do becomes "takt-$name: --of $name two" $name --of $name two; done
for name in calibrate cloud objects terrain train; do becomes "takt-tools: $name --of $name" $name --of $name; done
for name in run check top replay; do becomes "takt: $name --of $name" $name --of $name; done
becomes "takt: run --web graph.yaml" run --web graph.yaml
finish
