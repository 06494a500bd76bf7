#!/usr/bin/env bash
# A private PostgreSQL server for tests: postgresql.sh start DIR prints its port on the loopback; postgresql.sh stop DIR ends
# it and removes the folder; postgresql.sh halt DIR [fast|immediate] ends it only, and resume DIR PORT goes on. The superuser
# is `forest`, without a password. It runs as another user where this one is root, which PostgreSQL refuses.
set -euo pipefail
bin=$(ls -d /usr/lib/postgresql/*/bin 2>/dev/null | sort -V | tail -1)
[[ -n $bin ]] || { echo "postgresql.sh: there is no PostgreSQL here; install Debian's package postgresql" >&2; exit 77; }
command=$1 folder=$2
as_user() {
  if [[ $(id -u) == 0 ]]; then
    setpriv --reuid=postgres --regid=postgres --clear-groups env HOME="$folder" "$@"
  else
    "$@"
  fi
}

run_at() {  # PORT
  as_user "$bin/pg_ctl" -D "$folder/data" -w -t 60 -l "$folder/server.log" \
    -o "-p $1 -c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c fsync=off -c full_page_writes=off -c max_connections=40" \
    start >>"$folder.log" 2>&1
}

case $command in
  start)
    mkdir -p "$folder"
    folder=$(realpath "$folder")
    [[ $(id -u) != 0 ]] || chown postgres "$folder"
    as_user "$bin/initdb" -D "$folder/data" -U forest --auth=trust --no-sync --locale=C.UTF-8 --encoding=UTF8 >"$folder.log" 2>&1 ||
      { cat "$folder.log" >&2; exit 1; }
    for try in 1 2 3 4 5 6 7 8; do
      port=$(/usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
      if run_at "$port"; then
        echo "$port"
        exit 0
      fi  # the port may have been taken since; try another
    done
    cat "$folder.log" "$folder/server.log" >&2
    exit 1
    ;;
  halt) as_user "$bin/pg_ctl" -D "$(realpath "$folder")/data" -m "${3:-immediate}" -w stop >/dev/null 2>&1 ;;
  resume)
    folder=$(realpath "$folder")
    run_at "$3"
    ;;
  stop)
    folder=$(realpath "$folder")
    as_user "$bin/pg_ctl" -D "$folder/data" -m immediate -w stop >/dev/null 2>&1 || true
    rm -rf "$folder" "$folder.log"
    ;;
  *) echo "postgresql.sh start|halt|resume|stop DIR" >&2; exit 2 ;;
esac
