/* The bytes of the built page, between two symbols; none where it was left out. */
    .section .rodata
    .global simulcap_report_page_begin
    .global simulcap_report_page_end
    .balign 16
simulcap_report_page_begin:
    .incbin REPORT_PAGE
simulcap_report_page_end:
    .byte 0
    .section .note.GNU-stack,"",@progbits
