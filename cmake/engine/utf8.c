#include <errno.h>
#include <stdio.h>
#include <windows.h>

FILE* mjenv_fopen(const char* path, const char* mode) {
  wchar_t wide_path[1024], wide_mode[8];
  const int most = sizeof wide_path / sizeof *wide_path, most_of_mode = sizeof wide_mode / sizeof *wide_mode;
  if (MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, wide_path, most) &&
      MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, mode, -1, wide_mode, most_of_mode))
    return _wfopen(wide_path, wide_mode);
  errno = ENOENT;
  return NULL;
}
