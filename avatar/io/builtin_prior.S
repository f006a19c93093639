/* Embeds the fitted pose prior; found through the include path (the top of the tree). */
    .section .rodata
    .balign 16
    .global simulcap_cmu_pose_prior
    .global simulcap_cmu_pose_prior_end
simulcap_cmu_pose_prior:
    .incbin "avatar/io/data/cmu_pose_prior.npz"
simulcap_cmu_pose_prior_end:
    .byte 0
    .section .note.GNU-stack,"",%progbits
