# What the fault tests share: jobs of which each leaves several files, twice over, and what may be seen of them.
# To be sourced, with the program's folder as the first argument.
set -euo pipefail
set -m # or a shell's background programs would not hear Ctrl-C; see also start()
PATH=$(realpath "$1"):$PATH
data=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../../data")
work=$(mktemp -d)
trap 'umount "$work/disk" 2>/dev/null || true; rm -rf "$work"' EXIT
RANDOM=${TAIHU_SEED:-1}
wrong=0
jobs=(carve split maps tiles fit)

bad() {
  echo "  $*"
  wrong=$((wrong + 1))
}

# words JOB before|now: what the job runs; its two ways give other bytes.
words() {
  local in=$work/in
  case $1 in
    carve) words=(carve "$in/base.vdb" --holes "$in/$2.csv" -o rock.glb) ;;
    split) words=(lod "$in/$2.vdb" --levels 2 --split -o levels) ;;
    maps) words=(bake "$in/$2.vdb" --levels 1 --size 128 --maps maps --report report.json -o low.glb) ;;
    tiles)
      local seed=1
      [ "$2" = now ] && seed=2
      words=(rock --preset swiss_cheese --seed "$seed" --dim 130 --tiles 128 --holes holes.csv -o tiles) ;;
    fit)
      local family=gamma
      [ "$2" = now ] && family=weibull
      words=(fit "$data/measurements/rock1.csv" --family "$family" --resamples 19 -o law.json --report law.html) ;;
  esac
  words=(taihu "${words[@]}" -q)
}

# hashes FOLDER: of what can be seen in it.
hashes() {
  (cd "$1" && find . -name '.taihu-tmp-*' -prune -o -type f -print0 | sort -z | xargs -0r sha256sum)
}

leftovers() {
  find "$1" -name '.taihu-tmp-*' -prune -print
}

# Each job both ways, undisturbed: what it leaves, and how long it takes [ms].
declare -A takes
prepare() {
  local in=$work/in job way
  mkdir -p "$in"
  printf 'x_m,y_m,z_m,radius_m\n0.5,0,0,0.25\n0,0.5,0,0.3\n0,0,-0.5,0.2\n' >"$in/before.csv"
  printf 'x_m,y_m,z_m,radius_m\n0.5,0,0,0.3\n0,0.5,0,0.2\n0,0,-0.5,0.25\n' >"$in/now.csv"
  taihu shape sphere --dim "${TAIHU_DIM:-24}" -o "$in/base.vdb" -q
  for way in before now; do
    taihu carve "$in/base.vdb" --holes "$in/$way.csv" -o "$in/$way.vdb" -q
    for job in "${jobs[@]}"; do
      mkdir -p "$work/$job/$way"
      words "$job" "$way"
      local start=${EPOCHREALTIME/./}
      (cd "$work/$job/$way" && "${words[@]}")
      takes[$job]=$(((${EPOCHREALTIME/./} - start) / 1000))
      hashes "$work/$job/$way" >"$work/$job/$way.sums"
    done
  done
}

# judge JOB FOLDER: sets `state` to before, now, none (nothing there), or between (each file of one of them),
# and reports files that are of neither, and lists whose files are not all theirs.
judge() {
  local sums list folder
  sums=$(hashes "$2")
  if [ -z "$sums" ]; then
    state=none
  elif [ "$sums" = "$(cat "$work/$1/before.sums")" ]; then
    state=before
  elif [ "$sums" = "$(cat "$work/$1/now.sums")" ]; then
    state=now
  else
    state=between
    grep -vxFf <(cat "$work/$1"/*.sums) <<<"$sums" >"$work/torn" && bad "$1: torn: $(cat "$work/torn")"
  fi
  for list in "$2"/*/{files,manifest,tiles}.json; do
    [ -e "$list" ] || continue
    folder=$(dirname "$list")
    tr -d ' \n' <"$list" | grep -o '"file":"[^"]*"[^}]*' |
      sed 's/"file":"\([^"]*\)".*"sha256":"\([0-9a-f]*\)".*/\2  \1/' >"$work/listed"
    [ -s "$work/listed" ] && (cd "$folder" && sha256sum -c --status "$work/listed") ||
      bad "$1: $list lists what is not there"
  done
}

# start JOB FOLDER ROUND: in a folder with the files of before, or in an empty one every third time, makes those
# of now; sets `pid` and `was`.
start() {
  rm -rf "$2"
  mkdir "$2"
  was=none
  if [ $(($3 % 3)) != 0 ]; then
    cp -r "$work/$1/before/." "$2"
    was=before
  fi
  words "$1" now
  (cd "$2" && exec env --default-signal=INT,TERM "${words[@]}" >"$work/said" 2>&1) &
  pid=$!
}

# pause JOB: up to a little longer than the job takes; every other time near its end, where files are written.
pause() {
  local most=$((takes[$1] * 11 / 10)) least=0
  [ $((RANDOM % 2)) = 0 ] && least=$((takes[$1] * 7 / 10))
  local ms=$((least + (RANDOM * 32768 + RANDOM) % (most - least + 1)))
  sleep "$(printf '%d.%03d' $((ms / 1000)) $((ms % 1000)))"
}

# One line, which names `path` or says why without one; and an exit code that a user can tell from a bug's.
refused() { # JOB CODE WHAT
  local lines
  lines=$(wc -l <"$work/said")
  [ "$2" = 1 ] && [ "$lines" = 1 ] && [ "$(wc -c <"$work/said")" -le 400 ] && grep -q '^taihu: ' "$work/said" ||
    bad "$1 $3: exit code $2, said: $(head -c 300 "$work/said")"
}
