# qp_embed(OUTPUT_VARIABLE SYMBOL files...)
# Makes, at build time, a C file that holds the given text files as the table SYMBOL declared in
# host/base/embedded.h (name without folder, bytes, length), and sets OUTPUT_VARIABLE to that file.
set(QP_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_DIR}/embed_files.cmake)
function(qp_embed output_variable symbol)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/generated/${symbol}.c)
  list(JOIN ARGN "|" files)
  add_custom_command(OUTPUT ${output}
                     COMMAND ${CMAKE_COMMAND} -DSYMBOL=${symbol} -DOUTPUT=${output} "-DFILES=${files}"
                             -P ${QP_EMBED_SCRIPT}
                     DEPENDS ${ARGN} ${QP_EMBED_SCRIPT}
                     COMMENT "Embedding ${symbol}" VERBATIM)
  set(${output_variable} ${output} PARENT_SCOPE)
endfunction()
