#!/bin/sh
# Say where a page is, and open it in the browser where there is a display.
page=$1
case $page in /*) ;; *) page=$PWD/$page ;; esac
echo "The report: $page"
if [ -n "$DISPLAY$WAYLAND_DISPLAY" ] && command -v xdg-open > /dev/null; then
    xdg-open "$page" > /dev/null 2>&1 &
elif [ "$(uname)" = Darwin ] && [ -z "$SSH_CONNECTION" ]; then
    open "$page"
else
    echo 'Open it in a browser: it needs no network.'
fi
