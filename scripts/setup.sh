# Shared by `run`, `check` and whoever else needs a ready machine; sourced, not executed.
# Every function may be called again and again: it does nothing where nothing is missing, and says in one line
# what it does where something is.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { printf '%s: %s\n' "${0##*/}" "$*" >&2; }

stop() {
  local code=$1
  shift
  say "$*"
  exit "$code"
}

# install PURPOSE PACKAGE…: Debian and Ubuntu packages; elsewhere says what is missing and stops.
install() {
  local purpose=$1 sudo=""
  shift
  command -v apt-get >/dev/null || stop 2 "missing: $purpose. Install it (on Debian and Ubuntu: $*) and try again"
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || stop 2 "missing: $purpose. As root: apt-get install $*"
    sudo=sudo
  fi
  say "installing $purpose ($*)"
  $sudo apt-get -qq update >&2
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends "$@" >&2
}

need_rust() {
  command -v cargo >/dev/null || stop 2 "missing: Rust 1.95 or newer (cargo). Install it with rustup and try again"
  command -v cc >/dev/null || install "a C linker" build-essential
  # Blosc brings a library in C++.
  command -v c++ >/dev/null || install "a C++ compiler" build-essential
}

# need_component COMMAND COMPONENT: a cargo subcommand that rustup's minimal profile leaves out.
need_component() {
  cargo "$1" --version >/dev/null 2>&1 && return
  command -v rustup >/dev/null || stop 2 "missing: cargo $1. Install your system's package for $2"
  say "adding $2"
  (cd "$root" && rustup -q component add "$2")
}

# Builds the optimised program and sets `spectile` to its path.
build() {
  local target=${CARGO_TARGET_DIR:-target} quiet=--quiet
  case $target in /*) ;; *) target=$root/$target ;; esac
  spectile=$target/release/spectile
  if [ ! -x "$spectile" ]; then
    say "building, which takes some minutes the first time"
    quiet=""
  fi
  (cd "$root" && cargo build --release --locked $quiet)
}

# `spectile devices` ends with 3 where no adapter can be used, and only then.
has_device() {
  local code=0
  "$spectile" devices >/dev/null 2>&1 || code=$?
  [ "$code" -ne 3 ]
}

# Where there is no usable GPU, Mesa's software Vulkan does.
need_device() {
  has_device && return
  case $(uname -s) in
    Linux) install "a software Vulkan driver" mesa-vulkan-drivers libvulkan1 ;;
    *) stop 3 "no adapter that Spectile can use; \`$spectile devices\` says why" ;;
  esac
  has_device || stop 3 "still no adapter that Spectile can use; \`$spectile devices\` says why"
}

# A real Slurm for the tests of array jobs, which bring up clusters of their own and end them; nothing is left running. Where
# there are no Debian packages the tests say that they are skipped.
need_slurm() {
  local program
  for program in munged slurmctld slurmd sbatch srun; do
    PATH=$PATH:/usr/sbin:/sbin command -v "$program" >/dev/null && continue
    if ! command -v apt-get >/dev/null; then
      say "no Slurm here, and no apt-get to install it: tests of array jobs will say that they are skipped"
      return
    fi
    install "Slurm" slurmctld slurmd slurm-client slurm-wlm-basic-plugins munge
    break
  done
  export SPECTILE_SLURM=required
}

# What installs another Debian beside this one, for the test with its driver.
need_debootstrap() {
  command -v apt-get >/dev/null || return 0
  PATH=$PATH:/usr/sbin command -v debootstrap >/dev/null || install "what installs another Debian" debootstrap
}

# The readers that cubes are tested with, in .venv; sets SPECTILE_PYTHON for the tests.
need_python() {
  local wanted=$root/tests/python/requirements.txt venv=$root/.venv
  command -v python3 >/dev/null || install "Python" python3 python3-venv
  if ! python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    say "$(python3 --version) is too old for zarr 3, which needs 3.11: tests with xarray will say that they are skipped"
    return
  fi
  if ! cmp -s "$wanted" "$venv/requirements.txt"; then
    # Debian's python3 comes without what venv needs.
    python3 -c 'import ensurepip' 2>/dev/null || install "Python's venv" python3-venv
    say "installing readers of cubes and exports (xarray, rasterio, OpenEXR, …) into .venv"
    python3 -m venv --clear "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check -r "$wanted"
    cp "$wanted" "$venv/requirements.txt"
  fi
  export SPECTILE_PYTHON=$venv/bin/python
}

# The Python package, put together in the folder of what is built; sets SPECTILE_PACKAGE for the tests. Needs `build` and `need_python`.
need_package() {
  [ -n "${SPECTILE_PYTHON:-}" ] || return 0
  local built=${spectile%/spectile}
  export PYO3_PYTHON=$SPECTILE_PYTHON PYO3_BUILD_EXTENSION_MODULE=1
  [ -d "$built/package" ] || say "building the Python package"
  (cd "$root" && cargo build --release --locked --quiet -p spectile-python)
  "$SPECTILE_PYTHON" "$root/python/develop.py" "$built" "$built/package"
  export SPECTILE_PACKAGE=$built/package
}

# Makes a wheel of the Python package, of the release build; prints its path.
make_wheel() {
  local built=${spectile%/spectile} tools out
  tools=$built/wheel-tools out=$built/wheels
  command -v python3 >/dev/null || install "Python" python3 python3-venv
  if [ ! -x "$tools/bin/maturin" ]; then
    python3 -c 'import ensurepip' 2>/dev/null || install "Python's venv" python3-venv
    say "installing maturin, which makes wheels"
    python3 -m venv --clear "$tools"
    "$tools/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2'
  fi
  rm -f "$out"/spectile-*.whl
  "$tools/bin/maturin" build --quiet --release --locked --manifest-path "$root/python/Cargo.toml" --out "$out" >&2
  ls "$out"/spectile-*.whl
}

# A browser and what drives it, for the tests of the page; sets SPECTILE_CHROMIUM for them.
need_browser() {
  local folder=$root/tests/page
  if [ "$(uname -s)" != Linux ]; then
    say "the page is tested on Linux only: its tests will say that they are skipped"
    return
  fi
  command -v chromium >/dev/null || install "a browser to test the page with" chromium fonts-dejavu-core
  command -v npm >/dev/null || install "Node, which drives the browser" nodejs npm
  if ! cmp -s "$folder/package.json" "$folder/node_modules/.package.json"; then
    say "installing playwright-core into tests/page"
    (cd "$folder" && npm install --no-package-lock --no-audit --no-fund --silent)
    cp "$folder/package.json" "$folder/node_modules/.package.json"
  fi
  SPECTILE_CHROMIUM=$(command -v chromium)
  export SPECTILE_CHROMIUM
}
