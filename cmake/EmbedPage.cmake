# Writes SOURCE, a source that holds the text of PAGE, for src/report/page.h.
file(READ "${PAGE}" page)
foreach(place "rayrep:title" "rayrep:plain-text" "<!--rayrep:data-->")
  string(FIND "${page}" "${place}" first)
  string(FIND "${page}" "${place}" last REVERSE)
  if(first EQUAL -1 OR NOT first EQUAL last)
    message(FATAL_ERROR "${PAGE} has to hold '${place}' once")
  endif()
endforeach()
string(FIND "${page}" ")rayrep\"" ends)
if(NOT ends EQUAL -1)
  message(FATAL_ERROR "${PAGE} holds what ends a literal")
endif()
file(WRITE "${SOURCE}" "// Made from src/report/page.html by cmake/EmbedPage.cmake.
#include \"report/page.h\"

std::string_view rayrep::report_detail::page() {
  static constexpr char kPage[] = R\"rayrep(${page})rayrep\";
  return {kPage, sizeof kPage - 1};
}
")
