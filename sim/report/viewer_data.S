// The bundle of scripts/report, as CMake made it.
    .section .rodata
    .global arex_viewer_script_begin
    .global arex_viewer_script_end
    .global arex_viewer_style_begin
    .global arex_viewer_style_end
arex_viewer_script_begin:
    .incbin "viewer.js"
arex_viewer_script_end:
arex_viewer_style_begin:
    .incbin "viewer.css"
arex_viewer_style_end:
    .section .note.GNU-stack, "", @progbits
