/dev/fd/3: line 70: ./run.sh: No such file or directory
