#!/usr/bin/env bash
# Tries Planish on a machine with nothing on it: a minimal Debian with python3, python3-venv, make and git.
#
#   sudo bench/minimal_machine.sh [-r ROOT] [-o LOG] [STEP...]      steps: bare demo wheel test (all, in that order)
#
# The minimal system is built in ROOT by debootstrap (a temporary folder, removed at the end; a ROOT that is named is
# kept, and used again with all that is installed in it). It gets a clone of the last commit, and the steps run in it,
# cut off from the processes and mounts of this machine. Everything that they print goes to LOG
# (out/minimal-machine.log), too. Ends with the number of commands that did not do what they should.
#
#   bare   as a user who may not install packages: set-up names what is missing, and what needs none of it works
#   demo   as root: make demo
#   wheel  pip install . into an empty environment; planish demo without a checkout, from a read-only installation
#          with a home, and without one
#   test   as root: make test
#
# SUITE and MIRROR, when set, say which Debian (this machine's own otherwise). pip's settings are those of this machine.
set -euo pipefail

PLACE=/srv/planish  # of the clone in ROOT
repository=$(cd "$(dirname "$0")/.." && pwd)

main() {
    local root="" log="$repository/out/minimal-machine.log" option
    while getopts r:o: option; do
        case $option in
            r) root=$(realpath "$OPTARG") ;;
            o) log=$(realpath "$OPTARG") ;;
            *) exit 2 ;;
        esac
    done
    shift $((OPTIND - 1))
    [ "$(id -u)" = 0 ] || { echo "only root can build a system: sudo $0" >&2; exit 2; }
    command -v debootstrap >/dev/null || { echo "debootstrap is missing: apt install debootstrap" >&2; exit 2; }
    if [ -z "$root" ]; then
        root=$(mktemp -d -t minimal-machine.XXXXXX)
        trap "rm -rf --one-file-system '$root'" EXIT  # expanded now: the name is local to this function
    fi
    mkdir -p "$root"
    chmod 755 "$root"  # mktemp lets nobody else in, and the guest's / is here
    mkdir -p "$(dirname "$log")"
    build "$root"
    configure_pip "$root"
    clone "$root$PLACE"
    [ $# -gt 0 ] || set -- bare demo wheel test
    run_steps "$root" "$@" 2>&1 | tee "$log"
    exit "${PIPESTATUS[0]}"
}

build() {
    local root=$1 suite mirror
    [ ! -x "$root/usr/bin/make" ] || return 0
    suite=${SUITE:-$(. /etc/os-release && echo "$VERSION_CODENAME")}
    mirror=${MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' "Codename: $suite" "Created-By: Packages" | head -n 1)}
    debootstrap --variant=minbase --include=git,make,python3,python3-venv "$suite" "$root" "$mirror" >/dev/null
    chroot "$root" useradd --create-home guest
}

# The last commit; with the environment of an earlier run where ROOT has one.
clone() {
    if [ -d "$1" ]; then
        git -C "$1" -c safe.directory='*' fetch --quiet "$repository" HEAD
        git -C "$1" reset --quiet --hard FETCH_HEAD
    else
        git -c safe.directory='*' clone --quiet --no-hardlinks "$repository" "$1"
    fi
}

# The package index that this machine's pip uses, and the authorities that it trusts, are those of the minimal machine.
configure_pip() {
    local root=$1
    cp /etc/resolv.conf "$root/etc/resolv.conf"
    install_if_there /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"
    mkdir -p "$root/etc/xdg/pip"
    install_if_there /etc/pip.conf "$root/etc/pip.conf"
    install_if_there "${PIP_CONFIG_FILE:-$HOME/.config/pip/pip.conf}" "$root/etc/xdg/pip/pip.conf"
}

install_if_there() { [ ! -e "$1" ] || cp --dereference "$1" "$2"; }

# Local folders with packages that pip's settings name.
local_indexes() {
    local path
    { cat "$1"/etc/pip.conf "$1"/etc/xdg/pip/pip.conf; env | grep '^PIP_'; } 2>/dev/null \
        | grep -oE '/[^ =]+' | sed 's|^//*|/|; s|/simple$||' | sort -u \
        | while read -r path; do
            [ ! -d "$path" ] || echo "$path"
        done || true
}

run_steps() {
    local root=$1 folders pip_settings
    shift
    folders=$(local_indexes "$root")
    pip_settings=$(env | grep '^PIP_' || true)
    # Mounts and processes end with the namespace: nothing is left behind, however the run ends.
    unshare --mount --pid --fork --kill-child bash -c '
        root=$1 place=$2 folders=$3 pip_settings=$4
        shift 4
        mount -t proc proc "$root/proc"
        mount --rbind /dev "$root/dev"
        for folder in $folders; do
            mkdir -p "$root$folder"
            mount --bind "$folder" "$root$folder"
        done
        mapfile -t settings <<<"$pip_settings"
        exec chroot "$root" env -i ${settings:+"${settings[@]}"} LANG=C.UTF-8 HOME=/root \
            PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
            bash "$place/bench/minimal_machine_steps.sh" "$place" "$@"
    ' minimal-machine "$root" "$PLACE" "$folders" "$pip_settings" "$@"
}

main "$@"
