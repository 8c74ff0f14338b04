# Shared by scripts/demo and scripts/test. Not a program.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
jobs=$(nproc)
cd "$root"

say() { printf '\n== %s\n' "$*"; }

fail() {
  printf 'error: %s\nhint: %s\n' "$1" "$2" >&2
  exit 1
}

# Whether Node.js is there with an npm, from wherever: where it does not come from Debian, Debian's npm conflicts with it.
has_node() {
  command -v npm >/dev/null && [ "$(node -p 'process.versions.node.split(".")[0] >= 18' 2>/dev/null)" = true ]
}

# Installs what scripts/packages.txt names and is not there yet.
install_packages() {
  local wanted missing
  wanted=$(grep -v '^#' "$root/scripts/packages.txt")
  # shellcheck disable=SC2086
  missing=$(comm -23 <(printf '%s\n' $wanted | sort) \
    <({
      dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' $wanted 2>/dev/null | sed -n 's/^ii *//p'
      if has_node; then printf 'nodejs\nnpm\n'; fi
    } | sort -u))
  if [ -z "$missing" ]; then
    say "all packages are installed"
    return
  fi
  say "installing" $missing
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "packages are missing and this is not root: $(echo $missing)" "Run as root, or install sudo."
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get update -qq
  # shellcheck disable=SC2086
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing
}

# build PRESET [TARGET ...]: what was compiled before, here or in another clone, comes from a compiler cache.
build() {
  local preset=$1
  shift
  say "building ($preset)"
  export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
  export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=true CCACHE_SLOPPINESS=pch_defines,time_macros
  cmake --preset "$preset" >/dev/null
  cmake --build "$root/build/$preset" --parallel "$jobs" ${1:+--target "$@"}
}

# The segmented CT liver that Debian's libcgal-demo brings, put beside its model.toml.
fetch_liver() {
  local target=$root/meshes/models/liver/liver.inr.gz archive member
  [ -s "$target" ] && return
  for archive in /usr/share/doc/libcgal-dev/data.tar.gz /usr/share/doc/libcgal-dev/demo.tar.gz; do
    [ -e "$archive" ] || continue
    member=$(tar -tzf "$archive" | grep -m 1 '/liver\.inr\.gz$' || true)
    [ -n "$member" ] || continue
    tar -xzOf "$archive" "$member" >"$target.new" && mv "$target.new" "$target"
    return
  done
  fail "liver.inr.gz was not found in libcgal-demo's archives" "Reinstall the package: apt-get install --reinstall libcgal-demo"
}
