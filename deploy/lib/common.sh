# Shared by deploy/build, deploy/demo and tests/run. Source it; it defines functions only.

say() { printf '\033[1m==>\033[0m %s\n' "$*" >&2; }
if [ ! -t 2 ]; then say() { printf '==> %s\n' "$*" >&2; }; fi
die() { printf '%s: %s\n' "$(basename "$0")" "$*" >&2; exit "${2:-1}"; }

# listed FILE...: the package names in package lists
listed() { sed -e 's/#.*//' -e 's/[[:space:]]*$//' "$@" | grep -v '^$'; }

# install_packages NAME...: installs what is missing, and says what
install_packages() {
  local missing=() name
  for name in "$@"; do
    dpkg-query -W -f '${Status}' "$name" 2>/dev/null | grep -q 'ok installed' || missing+=("$name")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  say "installing ${#missing[@]} Debian packages: ${missing[*]}"
  local sudo=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || die "needs root (or sudo) to install: ${missing[*]}; or install them and use --no-install"
    sudo=(sudo)
  fi
  local log
  log=$(mktemp)
  { "${sudo[@]}" apt-get update -q && DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}"; } >"$log" 2>&1 ||
    { tail -n 20 "$log" >&2; die "installing packages failed"; }
  rm -f "$log"
}

# build_web: the web page into build/web, where npm is there and can fetch; else says so and goes on
build_web() {
  local log=build/web.log stale
  mkdir -p build
  if [ -f build/web/index.html ]; then
    stale=$(find clients/web -name node_modules -prune -o -type f -newer build/web/index.html -print -quit)
    [ -n "$stale" ] || return 0
  fi
  command -v npm >/dev/null || { say "npm is not installed: there will be no web page"; return 0; }
  say "building the web page"
  [ -d clients/web/node_modules/esbuild ] ||
    npm ci --prefix clients/web --omit=dev --no-fund --no-audit --fetch-retries=1 --loglevel=error >"$log" 2>&1 ||
    { say "the web page's packages could not be fetched ($log): there will be no web page"; return 0; }
  node clients/web/build.mjs >>"$log" 2>&1 || { tail -n 20 "$log" >&2; die "the web page could not be built ($log)"; }
}

# build_preset PRESET [cmake options --] TARGET...: configures where needed, and builds
build_preset() {
  local preset=$1; shift
  local options=()
  if [[ " $* " == *" -- "* ]]; then
    while [ "$1" != -- ]; do options+=("$1"); shift; done
    shift
  fi
  local log=build/$preset.log
  mkdir -p build
  export CCACHE_DIR=${CCACHE_DIR:-$PWD/build/.ccache}
  export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros,include_file_mtime,include_file_ctime}
  say "configuring build/$preset"
  cmake --preset "$preset" "${options[@]}" >"$log" 2>&1 || { tail -n 30 "$log" >&2; die "configuring failed ($log)"; }
  say "building build/$preset ${*:-everything}"
  if [ -t 2 ]; then
    cmake --build "build/$preset" ${1:+--target "$@"} >&2 || die "the build failed"
  else
    cmake --build "build/$preset" ${1:+--target "$@"} >"$log" 2>&1 || { grep -E 'error|FAILED|fatal' "$log" | head -n 20 >&2; tail -n 30 "$log" >&2; die "the build failed ($log)"; }
  fi
}
