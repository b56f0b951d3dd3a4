#!/usr/bin/env bash
# What bench/minimal_machine.sh runs inside the minimal machine: the folder of the clone, then the steps.
set -uo pipefail

cd "$1"
shift
failures=0

# expect CODE COMMAND...: run it, and tell its exit code and seconds; a code that was not expected is a failure.
expect() {
    local wanted=$1 start=$SECONDS code verdict=ok
    shift
    echo "+ $*"
    "$@"
    code=$?
    [ "$code" = "$wanted" ] || { verdict="NOT $wanted" failures=$((failures + 1)); }
    echo "= exit code $code ($verdict), $((SECONDS - start)) s"
}

as_guest() { setpriv --reuid guest --regid guest --init-groups env HOME=/home/guest "$@"; }

# Nobody's home cannot be written to, and HOME does not name one.
without_home() { setpriv --reuid nobody --regid nogroup --clear-groups env --unset=HOME "$@"; }

# The files differ in the time at which their scan was made.
SAME_PIXELS='import sys, numpy as np; from PIL import Image
one, other = (np.asarray(Image.open(name)) for name in sys.argv[1:])
sys.exit(not np.array_equal(one, other))'

bare() {
    rm -rf /home/guest/planish
    git -c safe.directory='*' clone --quiet "$PWD" /home/guest/planish
    chown -R guest: /home/guest/planish
    cd /home/guest/planish || return
    expect 0 as_guest make setup
    expect 0 as_guest .venv/bin/planish --help
    expect 0 as_guest .venv/bin/planish devices
    expect 4 as_guest .venv/bin/planish doctor  # there is no scanner
    expect 0 as_guest .venv/bin/python -c 'import drivers.simulated, restore, station.run.one_page'
    expect 2 as_guest .venv/bin/planish demo -o out/demo
    cd - >/dev/null || return
}

demo() { expect 0 make demo; }

wheel() {
    rm -rf /opt/planish /tmp/planish && mkdir -p /tmp/planish && chmod 1777 /tmp/planish
    expect 0 python3 -m venv /opt/planish
    expect 0 /opt/planish/bin/pip install --quiet --disable-pip-version-check .
    expect 0 apt-get -qq install --no-install-recommends $(/opt/planish/bin/planish doctor --packages)
    cd /tmp/planish || return
    expect 0 as_guest /opt/planish/bin/planish demo -o guest --json
    expect 0 as_guest /opt/planish/bin/planish scan --config simulated -o guest-scan
    expect 0 without_home /opt/planish/bin/planish demo -o nobody
    expect 0 /opt/planish/bin/python -c "$SAME_PIXELS" guest/page.png nobody/page.png
    cd - >/dev/null || return
}

tests() { expect 0 make test; }

for step in "$@"; do
    echo "== $step, $(. /etc/os-release && echo "$PRETTY_NAME"), $(python3 --version)"
    case $step in
        bare | demo | wheel) "$step" ;;
        test) tests ;;
        *) echo "there is no step $step" >&2; failures=$((failures + 1)) ;;
    esac
done
echo "== $failures commands did not do what they should"
exit "$failures"
