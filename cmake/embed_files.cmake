# Run by qp_embed: writes OUTPUT from FILES (separated by |). Bytes as numbers, because a string literal may be
# no longer than 4095 characters in C11. Each file ends in a NUL that its length leaves out.
string(REPLACE "|" ";" FILES "${FILES}")
set(arrays "")
set(table "")
set(index 0)
foreach(file ${FILES})
  file(READ ${file} hex HEX)
  file(SIZE ${file} size)
  get_filename_component(name ${file} NAME)
  string(REGEX REPLACE "(................................)" "\\1\n" hex "${hex}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(APPEND arrays "static const unsigned char file_${index}[] = {\n${bytes}0};\n")
  string(APPEND table "    {\"${name}\", file_${index}, ${size}},\n")
  math(EXPR index "${index} + 1")
endforeach()
file(WRITE ${OUTPUT}
     "#include \"host/base/embedded.h\"\n\n${arrays}\nconst qp_embedded ${SYMBOL}[] = {\n${table}    {0, 0, 0},\n};\n")
