#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Packs a build as a .deb and runs what is in it: package.sh BUILD PYTHON
# Skips (77) where the documentation site was not built, because Sphinx is missing, or where there is no dpkg.
set -euo pipefail
build=$1 python=$2
stage=$(mktemp -d)
trap 'rm -rf -- "$stage"' EXIT
[[ -f $build/docs/html/index.html ]] || { echo "skipped: there is no documentation site, which needs Sphinx"; exit 77; }
command -v dpkg-shlibdeps >/dev/null || { echo "skipped: this system has no dpkg"; exit 77; }

(cd -- "$build" && cpack -G DEB -B "$stage/deb" -D CPACK_SDAG_SITE="$build/docs/html") >"$stage/log" 2>&1 ||
    { cat "$stage/log"; exit 1; }
deb=$(echo "$stage"/deb/*.deb)
dpkg-deb -x "$deb" "$stage/root"
failures=0
for file in bin/shadowdag lib/shadowdag/sdag_openvdb.so lib/cmake/ShadowDAG/ShadowDAGConfig.cmake include/shadowdag/hybrid/frame.h \
            share/man/man1/shadowdag.1.gz share/bash-completion/completions/shadowdag \
            share/zsh/site-functions/_shadowdag share/doc/ShadowDAG/html/index.html; do
    [[ -s $stage/root/usr/$file ]] || { echo "FAILED: the package has no $file"; failures=1; }
done
depends=$(dpkg-deb -f "$deb" Depends)
for package in libembree libtbb libopenvdb python3-numpy; do
    [[ $depends == *$package* ]] || { echo "FAILED: the package does not depend on $package, but on $depends"; failures=1; }
done
"$stage/root/usr/bin/shadowdag" scene --list | grep atrium >/dev/null || { echo "FAILED: the program does not run"; failures=1; }
"$stage/root/usr/bin/shadowdag" voxelize builtin:fail-acne -o "$stage/a.svdag" --resolution 64 >/dev/null &&
    "$stage/root/usr/bin/shadowdag" export "$stage/a.svdag" -o "$stage/a.vdb" >/dev/null ||
    { echo "FAILED: the program does not export a grid of OpenVDB"; failures=1; }
PYTHONPATH=$stage/root/usr/lib/python3/dist-packages "$python" -c \
    "import shadowdag as sd; assert any('atrium' in name for name in sd.builtin_scenes())" ||
    { echo "FAILED: the module cannot be imported"; failures=1; }
((failures == 0)) && echo "$(basename "$deb") is complete"
exit $failures
