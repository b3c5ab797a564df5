#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The one script: installs what is missing, builds, reports, tests. Works on a bare Debian 12 or 13 from any directory.
set -euo pipefail

root=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")
cd -- "$root"

usage() {
    cat <<'END'
usage: ./do COMMAND

  report [SCENE... OPTION...]
                    installs missing packages, builds the program without its tests and writes report/index.html:
                    the methods, time against error, on the built-in atrium at 320x180. Arguments replace that
                    experiment and go to `shadowdag compare`, as in ./do report YOUR.glb --lights 32.
  python            installs missing packages and builds the program and the Python module, without the tests.
  test [--quick] [ARG...]
                    installs missing packages, builds everything and runs every test, those of CUDA on a device that the
                    host plays (preset cuda-host). Arguments go to ctest. The output and the names of failed tests
                    are repeated at the end.
                    --quick leaves out what starts the program, draws by OpenGL or renders for seconds.
  results [NAME...] installs missing packages, builds the program, measures committed results anew (tests/bench/results;
                    without a NAME what takes seconds) and ends with 5 if a count got worse.
  check [--all]     installs missing packages of development, then checks without building: format, clang-tidy
                    (of what changed since origin/HEAD; --all: of every source), and what tests/house checks:
                    headers alone, include order, settings, documents.
  docs              installs packages of development, builds the program and the Python module, and writes the
                    documentation site to build/docs/html; warnings and broken links are errors.
  fuzz MINUTES [TARGET...]
                    builds the targets of tests/fuzz with clang-19's libFuzzer and runs them, MINUTES in all;
                    inputs that they find stay in build/fuzz. Installs clang-19 if it is missing.
  arm64 [ARG...]    builds everything for arm64 by a cross compiler, with Debian's libraries for arm64 in
                    build/arm64-root, and runs the unit tests under qemu-user. Arguments go to ctest. Installs the
                    cross compiler, qemu-user and mmdebstrap if they are missing.
  build [PRESET]    configures and builds a preset (release): dev, release, cuda, asan, tsan, fuzz, ci,
                    werror, cuda-host, arm64 (after ./do arm64).
  packages [dev]    installs the missing ones of packages.txt; with dev those for development too.
  format            formats all sources with clang-format.
  help              prints this.

environment:
  SDAG_JOBS            parallel compilers and tests; default: cores, but one per 1.5 GiB of memory
  SDAG_PRESET          what test builds instead of ci
  SDAG_SKIP_PACKAGES   set to 1 to leave packages alone (on other systems than Debian)
END
}

fail() {
    printf './do: %s\n' "$*" >&2
    exit 1
}

# Prints the name of this system.
systemName() {
    . /etc/os-release 2>/dev/null && printf '%s' "${PRETTY_NAME:-unknown}" || printf unknown
}

# listPackages report|python|test|dev prints the packages of packages.txt that a purpose needs, one a line.
listPackages() {
    local without='/^#/d'
    case $1 in
        report) without='/^# --- the Python module ---/,$d' ;;
        python) without='/^# --- tests ---/,$d' ;;
        test) without='/^# --- development only ---/,$d' ;;
    esac
    sed -e "$without" -e '/^#/d' -e '/^[[:space:]]*$/d' packages.txt
}

# installPackages report|python|test|dev [REGEX] installs what is missing of them, or of those that match.
installPackages() {
    [[ ${SDAG_SKIP_PACKAGES:-} == 1 ]] && return 0
    if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
        fail "this system has no apt; ShadowDAG is built on Debian 12 and 13. Install what packages.txt names by your" \
             "system's means and set SDAG_SKIP_PACKAGES=1"
    fi
    local missing=() package
    for package in $(listPackages "$1"); do
        [[ $package =~ ${2:-.} ]] || continue
        [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
    done
    ((${#missing[@]} == 0)) && return 0
    local asRoot=()
    if (($(id -u) != 0)); then
        command -v sudo >/dev/null ||
            fail "${#missing[@]} packages are missing, and installing them needs root: install sudo, or run as root:" \
                 "apt-get install --no-install-recommends ${missing[*]}"
        asRoot=(sudo)
    fi
    printf './do: installing %d packages: %s\n' "${#missing[@]}" "${missing[*]}"
    [[ $(systemName) =~ ^"Debian GNU/Linux "1[23] ]] ||
        printf './do: ShadowDAG is built on Debian 12 and 13, this is %s\n' "$(systemName)"
    local apt=("${asRoot[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o Acquire::Retries=3
               -o Dpkg::Use-Pty=0)
    # Nobody keeps the machine of a CI run: syncing every file to the disk takes a third of the time.
    [[ -n ${CI:-} ]] && apt+=(-o Dpkg::Options::=--force-unsafe-io)
    "${apt[@]}" update </dev/null || fail "apt-get update failed; is there a network and a mirror?"
    "${apt[@]}" install -y --no-install-recommends "${missing[@]}" </dev/null ||
        fail "apt-get could not install the packages; ShadowDAG is built on Debian 12 and 13, this is $(systemName)"
}

# Prints how many compilers or tests run at once: a compiler over OpenVDB takes about a GiB.
jobs() {
    local cores memory
    cores=$(nproc)
    memory=$(($(sed -n 's/^MemTotal: *\([0-9]*\) kB/\1/p' /proc/meminfo) / 1572864))
    ((memory < 1)) && memory=1
    printf '%s' "${SDAG_JOBS:-$((cores < memory ? cores : memory))}"
}

# compile PRESET [cmake --build argument...] builds what is configured.
compile() {
    # Objects of one preset serve another: the compiler cache does not look at the folder. It takes what a source includes
    # from the compiler, which does not run a second time for it.
    export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1} CCACHE_DEPEND=${CCACHE_DEPEND:-1}
    cmake --build --preset "$1" --parallel "$(jobs)" "${@:2}"
}

# build PRESET [cmake --build argument...] configures and builds.
build() {
    cmake --preset "$1"
    compile "$@"
}

# buildWithoutTests TARGET... builds these of release, without the tests and their packages unless it has them already.
buildWithoutTests() {
    local tests=OFF
    [[ -e build/release/build.ninja ]] && grep -q '^SDAG_TESTS:BOOL=ON' build/release/CMakeCache.txt && tests=ON
    cmake --preset release -DSDAG_TESTS=$tests -DSDAG_BENCHES=$tests
    NINJA_STATUS='[%p, %e s] ' compile release --target "$@"
}

# step N TEXT prints what report does next, and how long it has taken so far.
step() {
    printf './do: %s of 3, %s (%s s so far)\n' "$1" "$2" "$SECONDS"
}

# runTests PRESET [ctest argument...] runs the tests of a build and notes the file of their results.
results=()
runTests() {
    results+=("build/$1/tests.xml")
    rm -f -- "${results[-1]}"
    ctest --preset "$1" --parallel "$(jobs)" --output-junit "$root/${results[-1]}" "${@:2}"
}

# Unpacks Debian's libraries for arm64, which packages.txt names, with what they need, into build/arm64-root; they come
# from where this system's apt has its packages. Nothing of them is run, and nothing of this system is changed.
unpackArm64() {
    local root=build/arm64-root libraries settings=build/arm64-apt.conf
    [[ -e $root.complete ]] && return 0
    libraries=$(listPackages test | grep -E '^(lib|nlohmann).*-dev$')
    rm -rf -- "$root"
    mkdir -p build
    apt-config dump | grep '^Acquire' >"$settings"
    (shopt -s nullglob
     mmdebstrap --variant=extract --architectures=arm64 --aptopt="$settings" --include="libc6-dev,${libraries//$'\n'/,}" '' \
                "$root" /etc/apt/sources.lis[t] /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources) ||
        fail "mmdebstrap could not unpack Debian's packages for arm64"
    # Some packages of CMake name their files by absolute paths.
    grep -rlZ --include='*.cmake' '"/usr' "$root/usr" | xargs -0r sed -i 's#"/usr\([/"]\)#"${CMAKE_SYSROOT}/usr\1#g'
    touch "$root.complete"
}

command=${1:-help}
(($# > 0)) && shift
case $command in
    report)
        step 1 'installing the missing packages: one to two minutes if all are missing'
        installPackages report
        step 2 'building the program: three to five minutes on two cores if nothing is built yet'
        buildWithoutTests shadowdag
        step 3 'measuring: less than a minute on two cores, for the experiment of ./do report'
        (($# > 0)) || set -- --experiment scenes/experiments/first.json
        build/release/tools/shadowdag compare -o report "$@"
        printf './do: %s s in all; open %s\n' "$SECONDS" "$root/report/index.html"
        ;;
    python)
        [[ $# == 0 ]] || fail "python takes nothing, not '$*'"
        installPackages python
        buildWithoutTests shadowdag sdag_python
        printf "./do: the module is in %s; try PYTHONPATH=%s /usr/bin/python3 -c 'import shadowdag'\n" \
               build/release/python build/release/python
        ;;
    test)
        preset=${SDAG_PRESET:-ci}
        if [[ ${1:-} == --quick ]]; then
            shift
            set -- -L '^unit$' "$@"
        fi
        installPackages test
        build "$preset"
        status=0
        trap 'python3 -B tests/house/failed_tests.py "${results[@]}"' EXIT # even if the second build fails
        runTests "$preset" "$@" || status=$?
        # The CUDA passes on a device that the host plays. What they share with the build before, the compiler cache has.
        build cuda-host
        runTests cuda-host "$@" --no-tests=ignore || status=$?
        exit $status
        ;;
    results)
        installPackages python
        buildWithoutTests shadowdag
        python3 -B tests/bench/results.py build/release/tools/shadowdag "$@"
        ;;
    check)
        [[ $# == 0 || $* == --all ]] || fail "check takes nothing or '--all', not '$*'"
        installPackages dev
        git ls-files -z -- '*.h' '*.cpp' '*.cu' | xargs -0 clang-format --dry-run -Werror
        cmake --preset werror
        cmake --build --preset werror --target sdag_provenance
        python3 tests/house/tidy.py "$root" build/werror --jobs "$(jobs)" "$@"
        SDAG_ALL_HEADERS=1 ctest --preset werror -L '^check$' # also those that this build compiles together
        ;;
    docs)
        [[ $# == 0 ]] || fail "docs takes nothing, not '$*'"
        installPackages dev
        build release --target shadowdag sdag_python
        /usr/bin/python3 -B docs/site/build.py build/release build/docs # Debian's own, which has Debian's Sphinx
        ;;
    fuzz)
        [[ ${1:-} =~ ^[0-9]+([.][0-9]+)?$ ]] || fail "fuzz takes minutes and targets, not '$*'"
        installPackages test
        command -v clang++-19 >/dev/null || installPackages dev clang
        build fuzz --target $(if (($# > 1)); then printf 'fuzz_%s ' "${@:2}"; else printf fuzzers; fi)
        python3 tests/fuzz/run.py build/fuzz "$1" --jobs "$(jobs)" "${@:2}"
        ;;
    arm64)
        installPackages test
        installPackages dev '^(g[+]{2}-aarch64-linux-gnu|mmdebstrap|qemu-user)$'
        unpackArm64
        build arm64
        runTests arm64 "$@"
        ;;
    build)
        installPackages test
        build "${1:-release}"
        ;;
    packages)
        [[ $# == 0 || $* == dev ]] || fail "packages takes nothing or 'dev', not '$*'"
        installPackages "${1:-test}"
        printf './do: all packages of packages.txt are installed\n'
        ;;
    format)
        git ls-files -z -- '*.h' '*.cpp' '*.cu' | xargs -0 clang-format -i
        ;;
    help | -h | --help)
        usage
        ;;
    *)
        usage >&2
        fail "unknown command '$command'"
        ;;
esac
