# flash_embed_file(<target> <symbol> <file>): the bytes of a file as flash::embedded::<symbol>(), a std::string_view,
# declared where it is used. The assembler reads the file, so that megabytes cost no compile time.
function(flash_embed_file target symbol file)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/embedded_${symbol}.cpp)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/embedded_file.cpp.in ${source} @ONLY)
  set_source_files_properties(${source} PROPERTIES OBJECT_DEPENDS ${file})
  target_sources(${target} PRIVATE ${source})
endfunction()

# flash_minify_javascript(<file> <variable>): the path of a smaller file of the same meaning, made at build time where
# esbuild is found, and the file itself otherwise. Licence comments stay.
function(flash_minify_javascript file variable)
  find_program(ESBUILD esbuild)
  if(NOT ESBUILD)
    set(${variable} ${file} PARENT_SCOPE)
    return()
  endif()
  get_filename_component(name ${file} NAME_WE)
  set(minified ${CMAKE_CURRENT_BINARY_DIR}/${name}.min.js)
  add_custom_command(OUTPUT ${minified} DEPENDS ${file} VERBATIM COMMENT "Minifying ${name}.js"
    COMMAND ${ESBUILD} ${file} --minify --legal-comments=inline --log-level=warning --outfile=${minified})
  set(${variable} ${minified} PARENT_SCOPE)
endfunction()

# What a report carries inside: plotly.js with its licence, and its page, report_template.html, as <symbol>.
function(flash_embed_report target symbol)
  find_file(PLOTLY_JS NAMES plotly.min.js plotly.js PATHS /usr/share/python3-plotly /usr/share/javascript/plotly
            REQUIRED DOC "plotly.js, drawn into reports (Debian: python3-plotly)")
  set(library ${PLOTLY_JS})
  if(NOT PLOTLY_JS MATCHES "min.js$")
    flash_minify_javascript(${PLOTLY_JS} library)
  endif()
  flash_embed_file(${target} plotly ${library})
  flash_embed_file(${target} plotly_licence ${PROJECT_SOURCE_DIR}/cmake/plotly_licence.txt)
  flash_embed_file(${target} ${symbol} ${CMAKE_CURRENT_SOURCE_DIR}/report_template.html)
endfunction()
