# Compiles several sources of a room as one file, so that their common headers are parsed once.
# Sources with compile options or definitions of their own stay separate. collision/ and
# scene/physics/ do too: what the compiler inlines there, and so their speed, must not depend on
# neighbouring files. So do small test programs, where a new test may use any name.

# enfilade_unity_build(TARGET SIZE [FOLDERS..]): groups the sources of each folder of TARGET, at most
# SIZE in one group. Each of FOLDERS is a list "base,log" of folders that share groups. An edit of a
# source then compiles at most SIZE of them.
function(enfilade_unity_build target size)
  if(NOT ENFILADE_UNITY)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources EXCLUDE REGEX "^/|^\\.\\./|^physics/")  # not of this folder, or see above
  set(rooms "")
  foreach(source ${sources})
    get_filename_component(folder ${source} DIRECTORY)
    foreach(folders ${ARGN})
      string(REPLACE "," ";" listed "${folders}")
      if(folder IN_LIST listed)
        list(GET listed 0 folder)
        string(APPEND folder "_and_others")
      endif()
    endforeach()
    string(MAKE_C_IDENTIFIER "room_${folder}" room)
    list(APPEND ${room} ${source})
    list(APPEND rooms ${room})
  endforeach()
  list(REMOVE_DUPLICATES rooms)
  foreach(room ${rooms})
    list(LENGTH ${room} count)
    math(EXPR groups "(${count} + ${size} - 1) / ${size}")
    set(index 0)
    foreach(source ${${room}})
      math(EXPR group "${index} * ${groups} / ${count}")  # groups of equal size
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${room}_${group})
      math(EXPR index "${index} + 1")
    endforeach()
  endforeach()
  # gcc takes the sources for headers here, and warns of their classes with members of unnamed
  # namespaces.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
