#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests the one script without installing or building: do_test.sh SOURCE_DIR
set -euo pipefail
script=$1/do
stage=$(mktemp -d)
trap 'rm -rf -- "$stage"' EXIT
failures=0

# check NAME STATUS TEXT COMMAND... : COMMAND must exit with STATUS and print TEXT.
check() {
    local name=$1 status=$2 text=$3 output got=0
    shift 3
    output=$("$@" 2>&1 </dev/null) || got=$?
    if [[ $got != "$status" || $output != *"$text"* ]]; then
        printf 'FAILED %s: status %s (wanted %s), wanted "%s" in:\n%s\n' "$name" "$got" "$status" "$text" "$output"
        failures=$((failures + 1))
    fi
}

bash -n "$script"
bash -n "$1/.ci/run"
[[ -x $script && -x $1/.ci/run ]] || { echo "FAILED: ./do and .ci/run must be executable"; failures=1; }

for command in $(grep -oh '\./do [a-z][a-z0-9]*' "$1/Containerfile" "$1/README.md" "$1"/docs/*.md | cut -d' ' -f2 | sort -u); do
    grep -q "^    $command\b" "$script" || { echo "FAILED: a document uses './do $command', which does not exist"; failures=1; }
done
cd -- "$stage" # any directory
check "help" 0 "report [SCENE... OPTION...]" "$script" help
check "nothing is help" 0 "test [--quick]" "$script"
check "unknown command" 1 "unknown command 'frobnicate'" "$script" frobnicate
check "packages refuses nonsense" 1 "not 'everything'" "$script" packages everything
check "docs refuses nonsense" 1 "not 'html'" "$script" docs html
check "fuzz refuses nonsense" 1 "not 'soon'" "$script" fuzz soon
check "results is explained" 0 "results [NAME...]" "$script" help
check "check refuses nonsense" 1 "not '--some'" "$script" check --some

# A machine made of stubs: only the tools of a bare system, and no apt.
mkdir bin
for tool in bash env dirname readlink sed cat nproc; do ln -s "$(command -v $tool)" bin/; done
stubs() { env -u SDAG_SKIP_PACKAGES PATH="$stage/bin" "$script" "$@"; }
check "no apt" 1 "SDAG_SKIP_PACKAGES=1" stubs packages

# With an apt that has nothing installed, and a user who is not root and has no sudo.
printf '#!/bin/sh\nexit 1\n' >bin/dpkg-query
printf '#!/bin/sh\necho apt-get "$@"\n' >bin/apt-get
printf '#!/bin/sh\necho 1000\n' >bin/id
chmod +x bin/dpkg-query bin/apt-get bin/id
check "no root" 1 "needs root" stubs packages
check "names what is missing" 1 " cmake " stubs packages

# As root: updates, then installs all of the list above the last marker, the rest only for dev, and for a report only what
# is above the first one.
printf '#!/bin/sh\necho 0\n' >bin/id
check "installs" 0 "install -y --no-install-recommends g++ cmake" stubs packages
check "updates first" 0 " update" stubs packages
check "tests need more than a report" 0 " xvfb" stubs packages
check "python refuses nonsense" 1 "not 'module'" stubs python module
check "dev installs more" 0 " clang-19" stubs packages dev
reported=$(stubs report 2>&1 || true) # ends there: nothing builds
if [[ $reported != *"--no-install-recommends g++ cmake"*" python3-matplotlib"* || $reported == *xvfb* ]]; then
    echo "FAILED: report must install what it needs and no more: $reported"
    failures=$((failures + 1))
fi
module=$(stubs python 2>&1 || true)
if [[ $module != *"--no-install-recommends g++ cmake"*" pybind11-dev"* || $module == *xvfb* ]]; then
    echo "FAILED: python must install what it needs and no more: $module"
    failures=$((failures + 1))
fi
if [[ $(stubs packages) == *clang-19* ]]; then
    echo "FAILED: development packages were installed without being asked for"
    failures=$((failures + 1))
fi

# With everything installed apt is left alone.
printf '#!/bin/sh\nprintf installed\n' >bin/dpkg-query
if [[ $(stubs packages) == *apt-get* ]]; then
    echo "FAILED: apt ran although nothing is missing"
    failures=$((failures + 1))
fi

# The end of what `test` prints has what failed, of both runs of ctest, and if the second build fails.
mkdir -p tree/build/werror tree/build/cuda-host tree/tests
cp "$script" "$1/packages.txt" tree/
ln -s "$1/tests/house" tree/tests/house
ln -s "$(command -v rm)" "$(python3 -c 'import sys; print(sys.executable)')" bin/
printf '#!/bin/sh\n[ "$*" != "--preset $BROKEN" ]\n' >bin/cmake
cat >bin/ctest <<'END'
#!/bin/bash
seq() { for ((i = 1; i <= $1; ++i)); do echo $i; done; }
cases='<testcase name="Passes" time="1" status="run"/>
<testcase name="Skips" time="1" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/></testcase>'
[[ $* != *"$FAILS"* ]] || cases+="
<testcase name='Fails' time='2.5' status='fail'><failure/><system-out>$(seq 100)</system-out></testcase>
<testcase name='HasNoProgram' time='0' status='notrun'><skipped message='Unable to find executable'/></testcase>"
while (($# > 0)) && [[ $1 != --output-junit ]]; do shift; done
[[ $# == 0 || -n $DIES ]] || echo "<testsuite>$cases</testsuite>" >"$2"
[[ $cases != *fail* && -z $DIES ]] || exit 8
END
chmod +x bin/cmake bin/ctest
tested() { env PATH="$stage/bin" SDAG_PRESET=werror FAILS=none BROKEN=none DIES= "$@" tree/do test 2>&1; }
lastLines="$(for ((i = 41; i <= 100; ++i)); do echo $i; done)"
names=$'tests failed\n  Fails\n  HasNoProgram'
check "test: none failed" 0 $'build/werror/tests.xml: 0 of 2 tests failed\nbuild/cuda-host/tests.xml: 0 of 2' tested
check "test: the first run failed" 8 "build/werror/tests.xml: 2 of 4 $names"$'\nbuild/cuda-host/tests.xml: 0' \
      tested FAILS=werror
check "test: the second run failed" 8 "build/werror/tests.xml: 0 of 2 tests failed"$'\n'"build/cuda-host/tests.xml: 2 of 4 $names" \
      tested FAILS=cuda-host
check "test: the last lines of a failed test" 8 $'----- Fails, after 2.5 s, the last of its output:\n'"$lastLines" \
      tested FAILS=werror
check "test: the second build failed" 1 "build/werror/tests.xml: 2 of 4 $names" tested FAILS=werror BROKEN=cuda-host
check "test: ctest died" 8 "build/werror/tests.xml: ctest ended before it wrote this" tested DIES=1
((failures == 0)) && echo "the script behaves"
exit $((failures > 0))
