# Compiles assets/*.xml into the library, as the array that core/engine/assets.hpp declares.
function(mjenv_embed_assets output)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/assets/*.xml)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${files})
  list(LENGTH files count)
  set(entries "")
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME)
    file(READ ${file} text)
    string(APPEND entries "    {\"${name}\", R\"mjcf(${text})mjcf\"},\n")
  endforeach()
  file(CONFIGURE OUTPUT ${output} @ONLY CONTENT
"#include \"engine/assets.hpp\"

namespace mjenv::core {

const Asset assets[] = {
@entries@};
const std::size_t asset_count = @count@;

}  // namespace mjenv::core
")
endfunction()
