#!/bin/sh
# Makes the base images of the Dockerfile where no registry can be reached, from Debian's packages
# and this machine's Rust:
#
#   docker/bases.sh IMAGE...
#
# Needs podman, debootstrap, root, and a Rust toolchain of the version that the image's name says.
# Images that are there already are kept.
set -eu

engine=${ENGINE:-podman}
suite=trixie
library=docker.io/library
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

exists() { $engine image exists "$library/$1"; }

# Builds an image from the Dockerfile on standard input: make IMAGE CONTEXT [OPTION...]
make() {
    image=$1
    context=$2
    shift 2
    cat > "$work/Dockerfile"
    $engine build --pull=never --file "$work/Dockerfile" --tag "$library/$image" "$@" "$context"
}

debian() {
    exists "debian:$suite-slim" && return
    debootstrap --variant=minbase "$suite" "$work/debian"
    tar --create --directory "$work/debian" --one-file-system . \
        | $engine import --change CMD=bash - "$library/debian:$suite-slim"
    rm -rf "$work/debian"
}

for image in "$@"; do
    exists "$image" && continue
    debian
    case $image in
        debian:$suite-slim) ;;
        node:*-slim)
            # Debian has one version of Node; the page's build says whether that will do.
            make "$image" "$work" <<END
FROM debian:$suite-slim
RUN apt-get update && apt-get install --yes --no-install-recommends nodejs npm
END
            ;;
        rust:*-slim-$suite)
            version=${image#rust:}
            version=${version%-slim-$suite}
            case $(rustc --version) in
                "rustc $version."*) ;;
                *) echo "$image: this machine has $(rustc --version)" >&2; exit 1 ;;
            esac
            echo share > "$work/ignore" # the documentation of Rust, which is most of it
            make "$image" "$(rustc --print sysroot)" --ignorefile "$work/ignore" <<END
FROM debian:$suite-slim
RUN apt-get update && apt-get install --yes --no-install-recommends ca-certificates gcc libc6-dev
ENV CARGO_HOME=/usr/local/cargo
COPY . /usr/local
END
            ;;
        *) echo "$image: no recipe" >&2; exit 2 ;;
    esac
done
