#!/bin/sh
# Makes the certificates of docs/security.md in a directory:
#
#   docker/secure/certificates.sh DIRECTORY NAME...
#
# ca.pem, which robots get, and ca.key, which nobody gets; service.pem and service.key for the service, valid for
# the names and addresses by which robots reach it: certificates.sh /etc/cogmap map.example.org 10.0.0.5
# An authority that is there already is used again. Needs openssl 1.1.1 or later.
set -eu

directory=$1
shift
[ $# -gt 0 ] || { echo "usage: $0 DIRECTORY NAME..." >&2; exit 2; }
umask 077
mkdir -p "$directory"
cd "$directory"

if ! [ -e ca.key ]; then
    openssl ecparam -name prime256v1 -genkey -noout -out ca.key
    openssl req -x509 -new -key ca.key -sha256 -days 3650 -subj "/CN=cogmap authority" -out ca.pem
fi

names=
for name in "$@"; do
    case $name in
        *:*) kind=IP ;;
        *[!0-9.]*) kind=DNS ;;
        *) kind=IP ;;
    esac
    names="$names${names:+,}$kind:$name"
done

openssl ecparam -name prime256v1 -genkey -noout -out service.sec1
openssl pkcs8 -topk8 -nocrypt -in service.sec1 -out service.key
rm service.sec1
openssl req -new -key service.key -subj "/CN=$1" -out service.csr
extensions=$(mktemp)
printf 'subjectAltName=%s\nextendedKeyUsage=serverAuth\nbasicConstraints=CA:FALSE\n' "$names" > "$extensions"
openssl x509 -req -in service.csr -CA ca.pem -CAkey ca.key -CAcreateserial -sha256 -days 825 \
    -extfile "$extensions" -out service.pem
rm service.csr "$extensions"
echo "made in $(pwd): give ca.pem to the robots, keep ca.key to yourself"
