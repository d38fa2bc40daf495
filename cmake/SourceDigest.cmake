# As a script, `cmake -DROOT=... -DFOLDERS="a;b" -DSYMBOL=... -DOUTPUT=... -P`: writes OUTPUT, a source of
# flash::source_digest::SYMBOL(), the SHA-256 of names and contents of all sources below the folders of ROOT. It depends
# on nothing else, so that every checkout of the same sources has the same.
set(FLASH_SOURCE_KINDS *.h *.cpp *.cu *.cuh)
if(CMAKE_SCRIPT_MODE_FILE)
  set(digests)
  foreach(folder IN LISTS FOLDERS)
    list(TRANSFORM FLASH_SOURCE_KINDS PREPEND ${ROOT}/${folder}/ OUTPUT_VARIABLE patterns)
    file(GLOB_RECURSE sources RELATIVE ${ROOT} ${patterns})
    list(SORT sources)
    foreach(source IN LISTS sources)
      file(SHA256 ${ROOT}/${source} digest)
      string(APPEND digests "${digest} ${source}\n")
    endforeach()
  endforeach()
  string(SHA256 digest "${digests}")
  file(WRITE ${OUTPUT} "#include <string_view>\n\nnamespace flash::source_digest {\n\nstd::string_view ${SYMBOL}();\n"
                       "std::string_view ${SYMBOL}() { return \"${digest}\"; }\n\n}  // namespace flash::source_digest\n")
  return()
endif()
set(FLASH_SOURCE_DIGEST_SCRIPT ${CMAKE_CURRENT_LIST_FILE})

# flash_source_digest(<target> <symbol> <folder>...): that function in a target, declared where it is used. It is made
# anew when one of the sources changes; nothing else is compiled again.
function(flash_source_digest target symbol)
  set(sources)
  foreach(folder IN LISTS ARGN)
    list(TRANSFORM FLASH_SOURCE_KINDS PREPEND ${PROJECT_SOURCE_DIR}/${folder}/ OUTPUT_VARIABLE patterns)
    file(GLOB_RECURSE found CONFIGURE_DEPENDS ${patterns})
    list(APPEND sources ${found})
  endforeach()
  set(output ${CMAKE_CURRENT_BINARY_DIR}/digest_of_${symbol}.cpp)
  # Made anew where a source has gone, too, which is younger than none.
  string(SHA256 names "${sources}")
  set(list ${output}.names)
  file(CONFIGURE OUTPUT ${list} CONTENT "${names}\n" @ONLY)
  add_custom_command(OUTPUT ${output} DEPENDS ${sources} ${list} ${FLASH_SOURCE_DIGEST_SCRIPT} VERBATIM
    COMMENT "Hashing the sources of ${symbol}"
    COMMAND ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} "-DFOLDERS=${ARGN}" -DSYMBOL=${symbol} -DOUTPUT=${output}
            -P ${FLASH_SOURCE_DIGEST_SCRIPT})
  # By itself, since what makes a source of a target waits for all libraries that the target links.
  set(objects flash_digest_of_${symbol})
  add_library(${objects} OBJECT ${output})
  set_target_properties(${objects} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_sources(${target} PRIVATE $<TARGET_OBJECTS:${objects}>)
endfunction()
