#!/bin/sh
# Is there what a build of spacearm needs? Prints the Python to use, or one sentence on what to install (exit 2).
#
#   sh tools/preflight.sh .venv
#
# An environment that is there already is used as it is. Otherwise $PYTHON if set, else the first Python of 3.10 or later.
venv=$1
missing= packages=

lacks() {   # what, Debian packages
    missing="$missing${missing:+ and }$1"
    packages="$packages $2"
}
is_new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2> /dev/null; }

# ---- Python ----
python=
if [ -e "$venv/bin/python" ] || [ -L "$venv/bin/python" ]; then
    if ! is_new_enough "$venv/bin/python"; then
        echo "The environment $venv has no working Python of version 3.10 or later: remove it (rm -rf $venv) and run make again." >&2
        exit 2
    fi
    python=$venv/bin/python
else
    for candidate in ${PYTHON:-python3 python3.14 python3.13 python3.12 python3.11 python3.10 python}; do
        if is_new_enough "$candidate"; then
            python=$candidate
            break
        fi
    done
fi

if [ -z "$python" ]; then
    asked=${PYTHON:-python3}
    version=$("$asked" -c 'import platform; print(platform.python_version())' 2> /dev/null)
    if [ -n "$version" ]; then found="$asked is $version"; else found="no $asked runs here"; fi
    lacks "Python 3.10 or later ($found; make PYTHON=/path/to/python3 names another)" "python3 python3-venv python3-dev"
else
    case $python in
        python3 | python | */*) debian=python3 ;;
        *) debian=$python ;;
    esac
    if [ "$python" != "$venv/bin/python" ] && ! "$python" -c 'import venv, ensurepip' 2> /dev/null; then
        lacks "Python's venv and ensurepip modules" "$debian-venv"
    fi
    if ! "$python" -c 'import os, sys, sysconfig
sys.exit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))' 2> /dev/null; then
        lacks "Python's C headers" "$debian-dev"
    fi
fi

# ---- compilers: the first that exists, as CMake looks for them ----
first_of() {
    for candidate in "$@"; do
        if command -v "${candidate%% *}" > /dev/null 2>&1; then
            echo "$candidate"
            return
        fi
    done
}
if [ -n "${CXX:-}" ]; then cxx=$(first_of "$CXX"); else cxx=$(first_of c++ g++ clang++); fi
if [ -n "${CC:-}" ]; then cc=$(first_of "$CC"); else cc=$(first_of cc gcc clang); fi
wanted="a C++20 compiler (GCC 11 or Clang 15, or later)"
if [ -z "$cxx" ]; then
    lacks "$wanted${CXX:+, and CXX=$CXX is none}" "g++"
elif ! $cxx -std=c++20 -fsyntax-only -x c++ - > /dev/null 2>&1 << 'END'
#if defined(__apple_build_version__)
#if __clang_major__ < 15
#error
#endif
#elif defined(__clang__)
#if __clang_major__ < 15
#error
#endif
#elif __GNUC__ < 11
#error
#endif
#include <atomic>
#include <concepts>
#include <vector>
END
then
    lacks "$wanted, which $cxx is not (CXX=... names another)" "g++"
elif [ -z "$cc" ]; then
    lacks "a C compiler${CC:+, and CC=$CC is none}" "gcc"
fi

if [ -n "$missing" ]; then
    echo "spacearm needs $missing: install it (on Debian or Ubuntu: apt install$packages) and run make again." >&2
    exit 2
fi
echo "$python"
