# Sourced by demo and test: goes to the repository's root and makes sure that what scripts/packages names is
# installed. Debian and Ubuntu: by apt-get, with sudo when not root. Elsewhere: names it and exits 3.

cd "$(dirname "${BASH_SOURCE[0]}")/.."

if command -v dpkg-query >/dev/null && command -v apt-get >/dev/null; then
    missing=()
    while read -r package; do
        state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
        [ "$state" = installed ] || missing+=("$package")
    done < <(grep -v '^#' scripts/packages)
    if [ "${#missing[@]}" -gt 0 ]; then
        echo "installing: ${missing[*]}" >&2
        as_root=()
        if [ "$(id -u)" -ne 0 ]; then
            as_root=(sudo)
            if ! command -v sudo >/dev/null; then
                echo "not root, and no sudo; install: ${missing[*]}" >&2
                exit 3
            fi
        fi
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -q --no-install-recommends "${missing[@]}" >&2
    fi
else
    # Not a Debian: the tools can be looked for, the rest is up to CMake and pkg-config.
    for tool in cc c++ cmake ninja pkg-config python3; do
        command -v "$tool" >/dev/null || lacking="${lacking-} $tool"
    done
    for module in OpenCL OpenImageIO jansson osmesa egl; do
        command -v pkg-config >/dev/null && pkg-config --exists "$module" || lacking="${lacking-} $module"
    done
    if [ -n "${lacking-}" ]; then
        echo "missing:$lacking; Debian's names for all that is needed:" >&2
        grep -v '^#' scripts/packages | paste -sd ' ' >&2
        exit 3
    fi
fi

# Kernels that PoCL has compiled are kept in the build folder, not in the home folder.
export POCL_CACHE_DIR="${POCL_CACHE_DIR:-$PWD/build-release/pocl-cache}"
mkdir -p "$POCL_CACHE_DIR"
