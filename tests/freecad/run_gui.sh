#!/usr/bin/env bash
# Tests in the real window of FreeCAD, on a screen of its own:  run_gui.sh SITE_PACKAGES [arguments of pytest]
# SITE_PACKAGES holds numba, scipy, pytest …, for FreeCAD's version of Python. Exits as pytest does.
set -euo pipefail
site=$1
shift
root=$(cd "$(dirname "$0")/../.." && pwd)
home=$(mktemp -d)
trap 'rm -rf "$home"' EXIT
export FREECAD_USER_HOME=$home CAD_IMPLICIT_PYTEST="$(printf '%q ' "$@")" CAD_IMPLICIT_ROOT=$root
# Without a locale FreeCAD 0.20 crashes at its start; as root its start page does with the sandbox of its browser.
export LANG=C.UTF-8 QTWEBENGINE_DISABLE_SANDBOX=1 OMP_WAIT_POLICY=passive PYTHONDONTWRITEBYTECODE=1
# A script that raises would leave FreeCAD open: the time limit.
timeout --kill-after=10 "${CAD_IMPLICIT_LIMIT:-1800}" xvfb-run -a -s "-screen 0 1400x900x24" \
  freecad -P "$site" -P "$root" -P "$root/freecad_workbench" "$root/tests/freecad/gui_pytest.py"
