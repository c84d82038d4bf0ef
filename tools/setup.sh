# Sourced by quickstart and check: installs Debian packages that are missing, and says what it does.

say() { printf '\n== %s\n' "$*"; }

# quietly LOG COMMAND...: runs it, its words into LOG; shows their end when it fails.
quietly() {
  local log=$1
  shift
  mkdir -p "$(dirname "$log")"
  "$@" >"$log" 2>&1 || { local code=$?; tail -n 40 "$log" >&2; echo "failed: $* (all of it: $log)" >&2; return $code; }
}

# install_missing KIND...: the packages of tools/packages.txt that these kinds need.
install_missing() {
  local kind package rest missing=()
  while read -r kind package rest; do
    case " $* " in *" $kind "*) ;; *) continue ;; esac
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q ' installed$' || missing+=("$package")
  done < <(grep -E '^(build|check) ' tools/packages.txt)
  install_packages "${missing[@]}"
}

install_packages() {
  [ $# -gt 0 ] || return 0
  local apt=(apt-get)
  if [ "$(id -u)" != 0 ]; then
    if sudo -n true 2>/dev/null; then
      apt=(sudo env DEBIAN_FRONTEND=noninteractive apt-get)
    else
      printf 'taihu needs these Debian packages, and installing them needs root:\n  sudo apt-get install %s\nThen run this again.\n' "$*" >&2
      exit 1
    fi
  fi
  say "installing $# Debian packages: $*"
  export DEBIAN_FRONTEND=noninteractive
  "${apt[@]}" -qq update
  "${apt[@]}" -qq install -y --no-install-recommends "$@" >/dev/null
}
