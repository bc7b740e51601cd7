# What cases begin with: sourced by their `run.sh`, whose folder is copied into one that goes at the end.
S=$(realpath "${SPECTILE:?set it to the path of the program}"); HERE=$(cd "$(dirname "$0")" && pwd)
T=$(mktemp -d); trap 'rm -rf "$T"' EXIT; cp -r "$HERE"/. "$T"; cd "$T"
export XDG_RUNTIME_DIR=$T RUST_BACKTRACE=0
bad=0; wrong() { echo "  wrong: $*"; bad=1; }
end() { [ $bad = 0 ] && echo PASS || { echo FAIL; exit 1; }; }
# refused WHAT WORDS COMMAND...: exits with a code between 2 and 5, and says WORDS
refused() { local what=$1 words=$2 code=0; shift 2; "$@" >out 2>err || code=$?
  [ $code -ge 2 ] && [ $code -le 5 ] && grep -q -- "$words" err || wrong "$what: exit $code: $(head -c 300 err)"; }
"$S" render scene.toml -o c.zarr --spp 1 >/dev/null 2>&1
