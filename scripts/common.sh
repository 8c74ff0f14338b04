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

# install_packages PART...: what scripts/packages.txt names in these parts and is not there yet
install_packages() {
  local wanted missing
  wanted=$(awk -v parts=" $* " '/^#/ { next } /^\[/ { taken = index(parts, " " substr($0, 2, length($0) - 2) " "); next } taken' "$root/scripts/packages.txt")
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

# build PRESET [TARGET ...]: what was compiled before, here or in another clone, comes from a compiler cache, with -Werror or without.
configure_options=()
build() {
  local preset=$1
  shift
  say "building ($preset)"
  export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
  export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=true CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_IGNOREOPTIONS=-Werror
  local before
  before=$(grep -s '^PALPATE_WERROR:' "$root/build/$preset/CMakeCache.txt" || true)
  cmake --preset "$preset" "${configure_options[@]}" >/dev/null
  # What is built for use and what is tested differ by -Werror alone, which the cache leaves out; but a precompiled header that is there counts
  # as an input of its own making, and would be new to it.
  if [ "$before" != "$(grep '^PALPATE_WERROR:' "$root/build/$preset/CMakeCache.txt")" ]; then
    find "$root/build/$preset" -name '*.gch' -delete
  fi
  nice cmake --build "$root/build/$preset" --parallel "$jobs" ${1:+--target "$@"}
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

# empty_debian SUITE FOLDER: a Debian with its essential packages alone, in which chroot works; for root. leave_debian FOLDER ends and removes it.
empty_debian() {
  local suite=$1 system=$2 mirror file
  [ "$(id -u)" -eq 0 ] || fail "this is not root" "debootstrap and chroot need root"
  command -v debootstrap >/dev/null || fail "debootstrap is missing" "apt-get install debootstrap"
  mirror=$(sed -n 's/^deb \(\[[^]]*\] \)\?\(http[^ ]*\) .*/\2/p;s/^URIs: //p' /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null | grep -m 1 '/debian/*$' || true)
  say "an empty Debian ($suite)"
  chmod 755 "$system"  # its root, which users other than root have to see through
  debootstrap --variant=minbase "$suite" "$system" ${mirror:+"$mirror"} >/dev/null
  echo force-unsafe-io >"$system/etc/dpkg/dpkg.cfg.d/quick"  # it is thrown away
  # As this machine reaches its registries.
  for file in /etc/apt/apt.conf.d /etc/apt/trusted.gpg.d /etc/ssl/certs /usr/local/share/ca-certificates /etc/npmrc /etc/pip.conf; do
    if [ -e "$file" ]; then mkdir -p "$system$(dirname "$file")" && cp -a "$file" "$system$(dirname "$file")/"; fi
  done
  mount -t proc proc "$system/proc"
  mount -t sysfs -o ro sysfs "$system/sys"
  mount --rbind --make-rslave /dev "$system/dev"
  chroot "$system" apt-get update -qq
}

leave_debian() {
  umount -l "$1/proc" "$1/sys" "$1/dev" 2>/dev/null || true
  rm -rf --one-file-system "$1"
}
